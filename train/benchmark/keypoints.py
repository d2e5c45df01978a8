"""`python -m train.benchmark keypoints`: retargeting keypoints to hands, beside dexi-rs and SciPy, as Markdown.

All follow the same frames and are judged by the same objective, computed here from its definition: the mean Huber loss
of wrist-to-keypoint vectors, and its whole with the smoothness that all of them are asked for. Contestants run in
turns, so that a machine whose speed drifts treats them alike. dexi-rs and SciPy go frame by frame, each from the frame
before.
"""

import importlib.util
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.export.urdf import write_urdf
from mjx_hand.robots.palm_frame import in_palm
from mjx_hand.robots.robot_hand import load_robot, robot_objective
from mjx_hand.robots.robot_urdf import robot_tree
from mjx_hand.robots.solver.keypoint_stream import KeypointStream
from mjx_hand.robots.solver.kinematic_tree import KinematicTree, tree_points
from mjx_hand.robots.solver.objectives import Objective
from mjx_hand.robots.solver.posture_samples import rest_posture
from mjx_hand.robots.solver.retarget_keypoints import retarget_keypoints
from train.reports.machine import machine

Array = np.ndarray
HANDS = ("human", "allegro", "shadow", "leap", "inspire", "ability", "schunk")
_FOLDERS = {"schunk": "schunk_hand/schunk_svh_hand_right.urdf"}


@dataclass(frozen=True)
class Options:
    """Measure the retargeting of keypoints to hands.

    Attributes:
        recording: a keypoint file; needed.
        hands: which hands, of human, allegro, shadow, leap, inspire, ability and schunk.
        copies: how many copies of the recording the batched solver does side by side in its second row.
        runs: timed repetitions, of which the median is given.
        scipy_frames: frames that SciPy does.
        out: Markdown file that the report is written to as well.
    """

    recording: Path | None = None
    hands: tuple[str, ...] = ("human", "allegro", "shadow")
    copies: int = 16
    runs: int = 5
    scipy_frames: int = 20
    out: Path | None = None


@dataclass(frozen=True)
class Task:
    """A hand, its objective, and the frames.

    Attributes:
        urdf: the hand's file, for dexi-rs.
        keypoints: in the frame of the hand's base.
    """

    tree: KinematicTree
    objective: Objective
    urdf: Path
    keypoints: Float[Array, "t 21 3"]


def report(options: Options) -> list[str]:
    """The lines of the report.

    Raises:
        InputError: options out of range, no recording, or dexi-rs, whose robot hands are used, is not installed.
    """
    for name in ("copies", "runs", "scipy_frames"):
        if getattr(options, name) < 1:
            raise InputError(f"{name} is {getattr(options, name)}; give at least 1")
    if unknown := [hand for hand in options.hands if hand not in HANDS]:
        raise InputError(f"hands has {unknown[0]!r}; valid: {', '.join(HANDS)}")
    if options.recording is None:
        return ["## Keypoints", "", "Give a keypoint file: `--recording FILE`."]
    if importlib.util.find_spec("dexi_rs") is None:
        raise InputError("the wheel dexi-rs is not installed; .venv/bin/pip install -e '.[dev]' brings it")
    positions = load_keypoints(options.recording, side="right").positions
    lines = [*machine("jax", "jaxlib", "numpy", "scipy", "dexi-rs"), ""]
    with tempfile.TemporaryDirectory() as folder:
        for hand in options.hands:
            task = make_task(hand, positions, Path(folder))
            lines += [f"## Keypoints onto the {hand} hand, {len(positions)} frames of {options.recording.name}", ""]
            lines += [*table(task, options), ""]
    return lines


def make_task(hand: str, positions: Float[Array, "t 21 3"], folder: Path) -> Task:
    """A robot hand's vectors as its description has them; the human hand's from the wrist to every keypoint."""
    if hand == "human":
        urdf = write_urdf(build_rigid_hand(load_hand()), folder / "human")
        links = _human_links()
        count = len(links) - 1
        objective = Objective(
            kind="vector",
            origins=(0,) * count,
            tasks=tuple(range(1, count + 1)),
            human_origins=(0,) * count,
            human_tasks=tuple(range(1, count + 1)),
        )
        keypoints = in_palm(positions, "right", np.array([-1.0, 0, 0]), np.array([0, -1.0, 0]))
        return Task(robot_tree(urdf, links), objective, urdf, keypoints)
    import dexi_rs

    urdf = Path(str(dexi_rs.asset_path("robots/hands"))) / _FOLDERS.get(hand, f"{hand}_hand/{hand}_hand_right.urdf")
    robot = load_robot(hand)
    tree, objective = robot_objective(robot, urdf)
    return Task(tree, objective, urdf, in_palm(positions, "right", robot.fingers, robot.palmar))


def _human_links() -> list[str]:
    """The rigid hand's link at each of the 21 keypoints."""
    links = ["wrist"]
    for name in KEYPOINTS[1:]:
        digit, joint = name.split("_")
        finger = "pinky" if digit == "little" else digit
        order = ("cmc", "mcp", "ip", "tip") if digit == "thumb" else ("mcp", "pip", "dip", "tip")
        links.append(f"{finger}_tip" if joint == "tip" else f"{finger}{1 + order.index(joint)}")
    return links


def table(task: Task, options: Options) -> list[str]:
    """One row per contestant: speed and both forms of the objective."""
    frames = len(task.keypoints)
    many = np.tile(task.keypoints[None], (options.copies, 1, 1, 1))
    dexi = dexi_solver(task)
    contestants: dict[str, tuple[int, Callable[[], Any]]] = {
        "mjx-hand, one recording": (frames, lambda: retarget_keypoints(task.keypoints, task.tree, task.objective)),
        f"mjx-hand, {options.copies} recordings": (
            options.copies * frames,
            lambda: retarget_keypoints(many, task.tree, task.objective),
        ),
        "dexi-rs, one thread": (frames, dexi),
    }
    dofs = {name: call() for name, (_, call) in contestants.items()}  # which also compiles
    seconds: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(options.runs):
        for name, (_, call) in contestants.items():
            started = time.perf_counter()
            call()
            seconds[name].append(time.perf_counter() - started)
    theirs = frames / float(np.median(seconds["dexi-rs, one thread"]))
    lines = ["| | frames/s | × dexi-rs | objective × 1000 | with smoothness |", "|---|---:|---:|---:|---:|"]
    for name, (count, _) in contestants.items():
        rate = count / float(np.median(seconds[name]))
        found = (
            dofs[name]
            if isinstance(dofs[name], np.ndarray)
            else dofs[name].dofs.reshape(-1, frames, task.tree.num_dofs)[0]
        )
        lines.append(f"| {name} | {rate:,.0f} | {rate / theirs:.1f} | {_figures(found, task)} |")
    part = Task(task.tree, task.objective, task.urdf, task.keypoints[: options.scipy_frames])
    started = time.perf_counter()
    found = scipy_frames(part)
    rate = len(found) / (time.perf_counter() - started)
    lines.append(
        f"| SciPy, the first {len(found)} frames | {rate:,.1f} | {rate / theirs:.2g} | {_figures(found, part)} |"
    )
    ours = dofs["mjx-hand, one recording"].dofs[: len(found)]
    lines.append(f"| mjx-hand, the same frames of the recording | | | {_figures(ours, part)} |")
    return [*lines, "", latency(task)]


def latency(task: Task) -> str:
    """A line on the time that one frame of a stream takes."""
    stream = KeypointStream(task.tree, task.objective)
    stream.warm_up()
    times = []
    for frame in task.keypoints.astype(np.float32):
        started = time.perf_counter()
        stream.step(frame)
        times.append(time.perf_counter() - started)
    middle, high = 1e3 * np.percentile(times, [50, 95])
    return f"One frame of a stream: {middle:.2f} ms at the median, {high:.2f} ms at the 95th percentile."


def dexi_solver(task: Task) -> Callable[[], Array]:
    """dexi-rs on all frames, from its own start."""
    import dexi_rs

    names, objective = task.tree.point_names, task.objective
    solver = dexi_rs.RetargetingConfig(
        "vector",
        str(task.urdf),
        target_origin_link_names=[names[k] for k in objective.origins],
        target_task_link_names=[names[k] for k in objective.tasks],
        target_joint_names=list(task.tree.dof_names),
        target_link_human_indices=[list(objective.human_origins), list(objective.human_tasks)],
        scaling_factor=float(objective.scaling),
        low_pass_alpha=1.0,  # which filters nothing
    ).build()
    vectors = task.keypoints[:, list(objective.human_tasks)] - task.keypoints[:, list(objective.human_origins)]
    rows = vectors.reshape(len(vectors), -1).tolist()
    order = [list(solver.joint_names).index(name) for name in task.tree.dof_names]

    def solve() -> Array:
        solver.reset()
        return np.array([solver.retarget(row) for row in rows])[:, order]

    return solve


def errors(dofs: Float[Array, "b n"], keypoints: Float[Array, "#b 21 3"], task: Task) -> Float[Array, "b k"]:
    """How far (m) each vector is from the person's."""
    points = np.asarray(tree_points(jnp.asarray(dofs, jnp.float32), task.tree), float)
    o = task.objective
    human = keypoints[:, list(o.human_tasks)] - keypoints[:, list(o.human_origins)]
    ours = points[:, list(o.tasks)] - points[:, list(o.origins)]
    return np.linalg.norm(ours - float(o.scaling) * human, axis=-1)


def huber(distance: Array, width: float) -> Array:
    """The Huber loss as dex-retargeting scales it."""
    return np.where(distance < width, distance**2 / (2 * width), distance - width / 2)


def _figures(dofs: Float[Array, "t n"], task: Task) -> str:
    value = huber(errors(dofs, task.keypoints, task), float(task.objective.huber)).mean()
    steps = (np.diff(dofs, axis=0) ** 2).sum(axis=1)
    whole = value + float(task.objective.smoothness) * steps.sum() / len(dofs)
    return f"{1e3 * value:.3f} | {1e3 * whole:.3f}"


def scipy_frames(task: Task) -> Float[Array, "t n"]:
    """SciPy's trust-region least squares, frame by frame, with differences for derivatives."""
    tree, width, smoothness = task.tree, float(task.objective.huber), float(task.objective.smoothness)
    before, found = np.asarray(rest_posture(tree), float), []
    lower, upper = np.asarray(tree.lower, float) - 1e-9, np.asarray(tree.upper, float) + 1e-9
    for k, frame in enumerate(task.keypoints[:, None]):
        hold = np.sqrt(smoothness) * (k > 0)

        def rows(dofs: Array, frame: Array = frame, anchor: Array = before, hold: float = hold) -> Array:
            loss = huber(errors(dofs, frame, task), width) / len(task.objective.tasks)
            return np.concatenate([np.sqrt(loss + 1e-12), hold * (dofs - anchor)], axis=1)

        def jacobian(dofs: Array, rows: Callable[[Array], Array] = rows) -> Array:
            step = 1e-3 * np.eye(len(dofs))  # positions are single precision
            both = rows(np.concatenate([dofs + step, dofs - step]))
            return ((both[: len(dofs)] - both[len(dofs) :]) / 2e-3).T

        start = np.clip(before, lower, upper)
        result = least_squares(
            lambda dofs, rows=rows: rows(dofs[None])[0],
            start,
            jac=jacobian,  # type: ignore[arg-type]  # SciPy's stubs know its names alone
            bounds=(lower, upper),
        )
        before = result.x
        found.append(before)
    return np.array(found)

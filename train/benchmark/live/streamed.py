"""How many held-out demonstrations the live twin holds, streamed as a tracker would see them, with each assistance.

A demonstration's hand goes in as keypoints: 30 frames a second, 3 mm of noise on each coordinate, 50 ms late, one frame
in twenty dropped. After the last frame the hand is held still for 5 s: an object is held that slips less than 2 cm in
the palm, and ends at least half as high as demonstrated, as `envs.evaluation.metrics.hold` has it.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.load_set import load_part
from envs.evaluation.metrics import HOLD_SECONDS, HOLD_SLIP, RAISED
from envs.live.sources.recorded import demonstration_source
from envs.live.twin.follower import Follower
from envs.live.twin.hand_solver import HandSolver
from envs.live.twin.pose import HandPose
from envs.live.twin.steady import Steady
from envs.live.twin.tabletop import demonstration_table
from envs.live.twin.world import ASSISTS, World
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from train.reports.machine import processor

_RATE, _NOISE, _DELAY, _DROPPED = 30.0, 0.003, 0.05, 0.05  # Hz, m, s, share of frames


@dataclasses.dataclass(frozen=True)
class Options:
    """Stream held-out demonstrations.

    Attributes:
        sets: folders of demonstration sets, one or more.
        count: demonstrations of each, at most.
    """

    sets: tuple[Path, ...] = ()
    count: int = 10


def report(options: Options) -> list[str]:
    """The shares held as Markdown.

    Raises:
        InputError: no sets, or a folder that is none.
    """
    if not options.sets:
        raise InputError("give --sets FOLDER …, demonstration sets as python -m envs.demonstrations makes them")
    lines = [
        f"{processor()}; keypoints at {_RATE:g}/s with {1e3 * _NOISE:g} mm noise, {1e3 * _DELAY:g} ms late, "
        f"{100 * _DROPPED:g} % dropped",
        "",
        f"| held | {' | '.join(ASSISTS)} |",
        f"|---|{'---:|' * len(ASSISTS)}",
    ]
    means = []
    for folder in options.sets:
        shown = load_part(folder, "heldout")[: options.count]
        shares = [float(np.mean([is_held(d, a, seed) for seed, d in enumerate(shown)])) for a in ASSISTS]
        means.append(shares)
        lines.append(_row(f"{shown[0].grasp} ({len(shown)})", shares))
    return [*lines, _row("mean", np.mean(means, axis=0))]


def is_held(shown: Demonstration, assist: str, seed: int) -> bool:
    """Whether the twin of a demonstration's hand, streamed, holds the object.

    Args:
        shown: the demonstration.
        assist: see `World`.
        seed: of noise and dropped frames.
    """
    source = demonstration_source(shown, shown.grasp)
    assert source.hand is not None
    solver, steady, rng = HandSolver(source.hand.rigid), Steady(), np.random.default_rng(seed)
    world = follower = pose = None
    end = (shown.num_frames - 1) / source.fps
    for k in range(round(end * _RATE) + 1):
        seen = source.keypoints[min(round(k / _RATE * source.fps), shown.num_frames - 1)]
        noisy = seen + _NOISE * rng.normal(size=seen.shape)
        if k == 0 or rng.random() >= _DROPPED:
            found = solver.solve(noisy)
            pose = steady.filtered(HandPose(*found), k / _RATE) if found is not None else None
        if world is None or follower is None:
            if pose is None:
                continue
            world, follower = World(source.hand.rigid, demonstration_table(shown), pose, assist), Follower(pose)
        while float(world.data.time) < (k + 1) / _RATE + _DELAY:
            world.step(follower.advance(pose, world.timestep))
    if world is None or follower is None:
        return False
    place, slip = _in_palm(world), 0.0
    for _ in range(round(HOLD_SECONDS / world.timestep)):
        world.step(follower.advance(pose, world.timestep))
        slip = max(slip, float(np.linalg.norm(_in_palm(world) - place)))
    rise = float(world.poses()[-1, 2] - shown.object_pose[0, 2])
    wanted = float(shown.object_pose[-1, 2] - shown.object_pose[0, 2])
    return slip < HOLD_SLIP and (rise >= wanted / 2 or wanted < RAISED)


def _in_palm(world: World) -> Float[np.ndarray, "3"]:
    """Where the object's centre is, seen from the wrist (m)."""
    wrist, carried = world.poses()[[0, -1]]
    return Rotation.from_quat(wrist[3:], scalar_first=True).inv().apply(carried[:3] - wrist[:3])


def _row(name: str, shares: Sequence[float] | np.ndarray) -> str:
    return f"| {name} | {' | '.join(f'{100 * share:.0f} %' for share in shares)} |"

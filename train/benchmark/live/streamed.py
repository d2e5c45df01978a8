"""How many held-out demonstrations the live twin holds, streamed as a tracker would see them, with each assistance.

A demonstration's hand goes in as keypoints: 30 frames a second, 3 mm of noise on each coordinate, 50 ms late, one frame
in twenty dropped. After the last frame the hand is held still for 5 s: an object is held that slips less than 2 cm in
the palm, and ends at least half as high as demonstrated, as `envs.evaluation.metrics.hold` has it. Then the fingers
open as far as they were at first: an object that was held is released that has fallen 0.7 s later.
"""

import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.load_set import load_part
from envs.demonstrations.streamed_hand import DROPPED, LATE, NOISE, RATE, streamed_poses
from envs.evaluation.metrics import HOLD_SECONDS, HOLD_SLIP, RAISED
from envs.live.assistance import ASSISTS, POLICY, assistance
from envs.live.twin.pose import HandPose
from envs.live.twin.tabletop import demonstration_table
from envs.live.twin.world import Assist, World
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from train.reports.machine import processor

_SEED = 10_000_000  # of the trackers, which are not those of training
_OPENING, _FALLING = 0.5, 0.7  # s in which the hand opens, and after which what it let go of has fallen


@dataclasses.dataclass(frozen=True)
class Options:
    """Stream held-out demonstrations.

    Attributes:
        sets: folders of demonstration sets, one or more.
        count: demonstrations of each, at most.
        policy: exported, to help in place of the project's.
    """

    sets: tuple[Path, ...] = ()
    count: int = 10
    policy: Path | None = None


def report(options: Options) -> list[str]:
    """The shares held as Markdown.

    Raises:
        InputError: no sets, or a folder that is none.
    """
    if not options.sets:
        raise InputError("give --sets FOLDER …, demonstration sets as python -m envs.demonstrations makes them")
    lines = [
        f"{processor()}; keypoints at {RATE:g}/s with {1e3 * NOISE:g} mm noise, {1e3 * LATE:g} ms late, "
        f"{100 * DROPPED:g} % dropped",
        "",
        f"| held, and then released | {' | '.join(ASSISTS)} |",
        f"|---|{'---:|' * len(ASSISTS)}",
    ]
    sets = [load_part(folder, "heldout")[: options.count] for folder in options.sets]
    sides = {shown[0].motion.side for shown in sets}
    if len(sides) > 1:
        raise InputError("--sets are of right hands and of left ones; give those of one side")
    side = sides.pop()
    assists: list[Assist] = [assistance(name, side, options.policy if name == POLICY else None) for name in ASSISTS]
    every = []
    for shown in sets:
        results = [[streamed(d, assist, _SEED + seed) for assist in assists] for seed, d in enumerate(shown)]
        every.append(np.mean(results, axis=0))
        lines.append(_row(f"{shown[0].grasp} ({len(shown)})", every[-1]))
    return [*lines, _row("mean", np.mean(every, axis=0))]


def streamed(shown: Demonstration, assist: Assist, seed: int) -> tuple[bool, bool]:
    """Whether the twin of a demonstration's hand, streamed, holds the object, and lets it go when its fingers open.

    Args:
        shown: the demonstration.
        assist: see `World`.
        seed: of noise and dropped frames.
    """
    rigid, poses = streamed_poses(shown, seed)
    world = first = pose = None
    for pose in poses:
        if world is None or first is None:
            world, first = World(rigid, demonstration_table(shown), pose, assist), pose
        world.step(pose)
    if world is None or pose is None or first is None:
        return False, False
    place, slip = _in_palm(world), 0.0
    for _ in range(round(HOLD_SECONDS / world.timestep)):
        world.step(pose)
        slip = max(slip, float(np.linalg.norm(_in_palm(world) - place)))
    top = float(world.poses()[-1, 2])
    wanted = float(shown.object_pose[-1, 2] - shown.object_pose[0, 2])
    held = slip < HOLD_SLIP and (top - shown.object_pose[0, 2] >= wanted / 2 or wanted < RAISED)
    for t in np.arange(0.0, _OPENING + _FALLING, world.timestep):
        share = min(t / _OPENING, 1.0)
        world.step(HandPose(pose.position, pose.quaternion, pose.angles + share * (first.angles - pose.angles)))
    return bool(held), bool(held and top - world.poses()[-1, 2] > max(wanted, RAISED) / 2)


def _in_palm(world: World) -> Float[np.ndarray, "3"]:
    """Where the object's centre is, seen from the wrist (m)."""
    wrist, carried = world.poses()[[0, -1]]
    return Rotation.from_quat(wrist[3:], scalar_first=True).inv().apply(carried[:3] - wrist[:3])


def _row(name: str, shares: Float[np.ndarray, "a 2"]) -> str:
    return f"| {name} | {' | '.join(f'{100 * held:.0f} %, {100 * let_go:.0f} %' for held, let_go in shares)} |"

"""A small robot hand with an arm, its URDF and description, and its forward kinematics, of this file's own.

Right hand: fingers along z, palm towards x, thumb's side y. Each of four digits has a hinge at its base and one in the
middle, which the last one follows. A person's hand of the same proportions is followed exactly.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.bodies.body import Body
from mjx_hand.bodies.body_places import body_model, model_places
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.capture.keypoints.layouts import KEYPOINTS

FOLLOW = 0.7
LIMIT = 1.6
LENGTHS = (0.045, 0.03, 0.02)
DIGITS = ("thumb", "index", "middle", "ring")
BASES: dict[str, list[float]] = dict(
    zip(DIGITS, ([0.01, 0.03, 0.03], [0, 0.03, 0.09], [0, 0, 0.095], [0, -0.03, 0.09]), strict=True)
)
TIPS = [KEYPOINTS.index(f"{digit}_tip") for digit in DIGITS]
MIRROR = np.array([1.0, -1.0, 1.0])


def direction(digit: str) -> np.ndarray:
    """Of a straight digit."""
    along = np.array([0, 1, 0.6]) if digit == "thumb" else np.array([0, 0, 1.0])
    return along / np.linalg.norm(along)


def keypoints_of(values: np.ndarray) -> np.ndarray:
    """(t, 21, 3): a right hand's keypoints at hinge values (t, 4, 2), wrist at the origin; NaN for little's."""
    points = np.full((len(values), 21, 3), np.nan)
    points[:, 0] = 0.0
    points[:, KEYPOINTS.index("little_mcp")] = [0, -0.055, 0.08]
    for d, digit in enumerate(DIGITS):
        along = direction(digit)
        axis = np.cross(along, [1.0, 0, 0])
        base, middle = values[:, d].T
        place = np.tile(np.array(BASES[digit], float), (len(values), 1))
        first = KEYPOINTS.index("thumb_cmc" if digit == "thumb" else f"{digit}_mcp")
        points[:, first] = place
        for k, angle in enumerate((base, base + middle, base + middle + FOLLOW * middle)):
            place = place + LENGTHS[k] * Rotation.from_rotvec(angle[:, None] * axis).apply(along)
            points[:, first + 1 + k] = place
    return points


def tips_of(body: Body, base: str, middle: str) -> tuple[np.ndarray, np.ndarray]:
    """Tips of a body in a few postures, and where its own kinematics have them in the axes of a person's wrist.

    Args:
        body: built from a file of this hand.
        base, middle: what its hinges are called, with {} for the digit.
    """
    values = postures(5)
    places = {name.format(d): values[:, k, j] for k, d in enumerate(DIGITS) for j, name in enumerate((base, middle))}
    targets = np.concatenate([np.zeros((5, 6)), np.stack([places[name] for name in body.joints], axis=1)], axis=1)
    _, tips = model_places(body, hand_coordinates(body_model(body), targets))
    wrist_from_robot = np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]])  # fingers z to -x, palm x to -y, side y to z
    wanted = keypoints_of(values)[:, TIPS]  # thumb, index, middle, ring
    return tips, wanted[:, [1, 2, 3, 0]] @ wrist_from_robot.T


def write(
    folder: Path,
    *,
    side: str = "right",
    fingers=(0, 0, 1),
    palmar=(1, 0, 0),
    arm: bool = False,
    limit: str = f'lower="0" upper="{LIMIT}"',
    last: str = f'lower="0" upper="{LIMIT}"',
    multiplier: float = FOLLOW,
) -> tuple[Path, Path]:
    """URDF and description; the hand hangs on two joints if it has an arm."""
    flip = MIRROR if side == "left" else np.ones(3)
    text = ['<robot name="little">']
    if arm:
        for name, parent, axis in (("shoulder", "world", "1 0 0"), ("wrist", "upper", "0 1 0")):
            child = "upper" if name == "shoulder" else "palm"
            text.append(
                f'<link name="{parent}"/><joint name="{name}" type="revolute"><parent link="{parent}"/>'
                f'<child link="{child}"/><axis xyz="{axis}"/><limit lower="-1" upper="1.5"/></joint>'
            )
    text.append('<link name="palm"/>')
    for digit in DIGITS:
        along = direction(digit)
        axis = np.cross(along, [1.0, 0, 0]) * flip * (-1 if side == "left" else 1)
        offsets = [np.array(BASES[digit], float), along * LENGTHS[0], along * LENGTHS[1], along * LENGTHS[2]]
        names = [f"{digit}_{part}" for part in ("base", "middle", "last", "tip")]
        for k, (name, offset) in enumerate(zip(names, offsets, strict=True)):
            parent = "palm" if k == 0 else names[k - 1]
            place = " ".join(f"{v:.9f}" for v in offset * flip)
            parts = f'<origin xyz="{place}"/><parent link="{parent}"/><child link="{name}"/>'
            if k < 3:
                parts += f'<axis xyz="{" ".join(f"{v:.9f}" for v in axis)}"/><limit {last if k == 2 else limit}/>'
            if k == 2:
                parts += f'<mimic joint="{names[1]}_joint" multiplier="{multiplier}"/>'
            kind = "revolute" if k < 3 else "fixed"
            text.append(f'<link name="{name}"/><joint name="{name}_joint" type="{kind}">{parts}</joint>')
    urdf, description = folder / "little.urdf", folder / "little.yaml"
    urdf.write_text("\n".join([*text, "</robot>"]))
    rows = ["palm: palm", "scaling: 1.0", f"fingers: {list(fingers)}", f"palmar: {list(palmar)}", "tips:"]
    description.write_text("\n".join([*rows, *(f"  {digit}_tip: {digit}_tip" for digit in DIGITS)]) + "\n")
    return urdf, description


def postures(count: int, seed: int = 0) -> np.ndarray:
    """(count, 4, 2): separate postures, well within the limits."""
    return np.random.default_rng(seed).uniform([0.1, 0.3], [1.2, 1.4], (count, 4, 2))


def motion(frames: int, fps: float) -> np.ndarray:
    """(frames, 4, 2): a lively motion."""
    t = np.arange(frames)[:, None] / fps
    wave = np.sin(3.0 * t * np.linspace(0.8, 1.2, 8) + np.arange(8))
    return (np.tile([0.6, 0.9], 4) + 0.4 * wave).reshape(-1, 4, 2)


def values_of(names: tuple[str, ...], dofs: np.ndarray) -> np.ndarray:
    """(t, 4, 2) of degrees of freedom (t, n) of these names."""
    columns = [names.index(f"{digit}_{part}_joint") for digit in DIGITS for part in ("base", "middle")]
    return np.asarray(dofs)[:, columns].reshape(-1, 4, 2)

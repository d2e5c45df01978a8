"""`RobotHand`: which links of a robot hand follow which keypoints, read from a small YAML file.

Descriptions that come with the project are `mjx_hand/robots/descriptions/NAME.yaml`, one file a hand; a path to another
file serves as well. The URDF is the user's own.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.capture.keypoints.layouts import KEYPOINTS
from mjx_hand.errors import InputError
from mjx_hand.files.safe_yaml import read_yaml, shown
from mjx_hand.robots.model_place import ModelPlace, model_place
from mjx_hand.robots.robot_urdf import robot_tree
from mjx_hand.robots.solver.kinematic_tree import BASE, KinematicTree
from mjx_hand.robots.solver.objectives import KINDS, Objective, dexpilot_pairs

ROBOTS = Path(__file__).parent / "descriptions"
SMALLEST, LARGEST = 0.05, 20.0  # of a robot over a person: from a toy to an excavator
_NEEDED = ("palm", "tips", "scaling", "fingers", "palmar")
_KNOWN = (*_NEEDED, "joints", "vectors", "urdf", "mjcf", "force_limits", "stiffness")
_MOST = 1e4  # N m, N m/rad


@dataclass(frozen=True)
class RobotHand:
    """A robot hand's description.

    Attributes:
        name: of the file.
        palm: the link at which the person's wrist is.
        tips: finger-tip links and the keypoints that they follow, the thumb's first.
        joints: further links and their keypoints.
        all_vectors: whether the objective `vector` follows `joints` too, not only `tips`.
        scaling: the robot's size over a person's.
        place: where its file is, where the description says so; a URDF, or an MJCF where it calls it so.
        force_limits, stiffness: of single joints (N m, N m/rad; of sliding ones N, N/m), in the place of what
            `robots.model.gains` would have.
        fingers, palmar: directions in the frame of the URDF's root link, unit and at right angles: where straight
            fingers point, and out of the palm.
    """

    name: str
    palm: str
    tips: dict[str, str]
    joints: dict[str, str]
    all_vectors: bool
    scaling: float
    fingers: np.ndarray
    palmar: np.ndarray
    place: ModelPlace | None = None
    force_limits: dict[str, float] = field(default_factory=dict)
    stiffness: dict[str, float] = field(default_factory=dict)


def known_robots() -> tuple[str, ...]:
    """The names of the descriptions that come with the project."""
    return tuple(sorted(path.stem for path in ROBOTS.glob("*.yaml")))


def load_robot(robot: str | Path) -> RobotHand:
    """A description by its name, or from a file.

    Raises:
        InputError: neither, or the description is incomplete.
    """
    path = ROBOTS / f"{robot}.yaml" if str(robot) in known_robots() else Path(robot)
    if not path.is_file():
        raise InputError(f"robot is {str(robot)!r}; valid: {', '.join(known_robots())}, or the path of a description")
    return _checked(path, read_yaml(path))


def _checked(path: Path, content: Any) -> RobotHand:
    if not isinstance(content, dict):
        raise InputError(f"{path}: not a description; it needs {', '.join(_NEEDED)}")
    if missing := [name for name in _NEEDED if name not in content]:
        raise InputError(f"{path}: has no {missing[0]!r}; it needs {', '.join(_NEEDED)}")
    if unknown := [name for name in content if name not in _KNOWN]:
        raise InputError(f"{path}: {shown(unknown[0])} is not known; valid: {', '.join(_KNOWN)}")
    follows = {}
    for name in ("tips", "joints"):
        links = content.get(name, {})
        if not isinstance(links, dict) or any(keypoint not in KEYPOINTS for keypoint in links.values()):
            raise InputError(f"{path}: {name} must give links their keypoints, of {', '.join(KEYPOINTS)}")
        follows[name] = {str(link): str(keypoint) for link, keypoint in links.items()}
    if len(follows["tips"]) < 2 or not next(iter(follows["tips"].values())).startswith("thumb"):
        raise InputError(f"{path}: tips must name two links or more, the thumb's first")
    if not isinstance(content["palm"], str):
        raise InputError(f"{path}: palm is {shown(content['palm'])}; give a link's name")
    vectors = content.get("vectors", "tips")
    if vectors not in ("tips", "all"):
        raise InputError(f"{path}: vectors is {shown(vectors)}; valid: tips, all")
    scaling = content["scaling"]
    if isinstance(scaling, bool) or not isinstance(scaling, int | float) or not SMALLEST <= scaling <= LARGEST:
        raise InputError(f"{path}: scaling is {shown(scaling)}; give a number from {SMALLEST:g} to {LARGEST:g}")
    fingers, palmar = (_direction(path, name, content[name]) for name in ("fingers", "palmar"))
    if abs(fingers @ palmar) > 1e-3:
        raise InputError(f"{path}: fingers and palmar must be at right angles; their cosine is {fingers @ palmar:.3f}")
    return RobotHand(
        name=path.stem,
        palm=content["palm"],
        tips=follows["tips"],
        joints=follows["joints"],
        all_vectors=vectors == "all",
        scaling=float(scaling),
        fingers=fingers,
        palmar=palmar,
        place=model_place(path, content),
        force_limits=_by_joint(path, "force_limits", content.get("force_limits", {})),
        stiffness=_by_joint(path, "stiffness", content.get("stiffness", {})),
    )


def _by_joint(path: Path, name: str, value: Any) -> dict[str, float]:
    if not isinstance(value, dict):
        raise InputError(f"{path}: {name} is {shown(value)}; give joints their numbers")
    for joint, number in value.items():
        if isinstance(number, bool) or not isinstance(number, int | float) or not 0 < number <= _MOST:
            raise InputError(
                f"{path}: {name} of {shown(joint)} is {shown(number)}; give a positive number, up to {_MOST:g}"
            )
    return {str(joint): float(number) for joint, number in value.items()}


def urdf_of(robot: RobotHand, given: str | Path | None = None) -> Path:
    """The robot's URDF or MJCF: the one given, or the description's own.

    Raises:
        InputError: neither is there.
    """
    if given is not None:
        return Path(given)
    if robot.place is None:
        raise InputError(
            f"{robot.name}: its description names no URDF; add urdf: FILE or mjcf: FILE to it, or give the file"
        )
    return robot.place.found(robot.name)


def _direction(path: Path, name: str, value: Any) -> np.ndarray:
    try:
        vector = np.array(value, dtype=float)
    except (TypeError, ValueError):
        vector = np.zeros(0)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not np.abs(vector).max() > 1e-6:
        raise InputError(f"{path}: {name} is {shown(value)}; give a direction of three numbers")
    vector = vector / np.abs(vector).max()
    return vector / np.linalg.norm(vector)


def robot_objective(robot: RobotHand, urdf: str | Path, kind: str = "vector") -> tuple[KinematicTree, Objective]:
    """A robot hand's tree and what it is asked to do.

    Args:
        robot: its description.
        urdf: its URDF; meshes are not needed.
        kind: a name in `objectives.KINDS`. `position` moves the base too and does not scale.

    Raises:
        InputError: unknown kind, or see `robot_tree`.
    """
    if kind not in KINDS:
        raise InputError(f"objective is {kind!r}; valid: {', '.join(KINDS)}")
    follows = robot.tips if kind == "dexpilot" or (kind == "vector" and not robot.all_vectors) else _all(robot)
    numbers = tuple(KEYPOINTS.index(keypoint) for keypoint in follows.values())
    if kind == "position":
        count = len(follows)
        pairs = ((BASE,) * count, tuple(range(count)), (BASE,) * count, numbers)
        return robot_tree(urdf, list(follows), robot.palm), _objective(kind, 1.0, pairs)
    tree = robot_tree(urdf, [robot.palm, *follows], robot.palm)
    if kind == "vector":
        count = len(follows)
        pairs = ((0,) * count, tuple(range(1, count + 1)), (KEYPOINTS.index("wrist"),) * count, numbers)
        return tree, _objective(kind, robot.scaling, pairs)
    human = (KEYPOINTS.index("wrist"), *numbers)
    origins, tasks = dexpilot_pairs(len(follows))
    pairs = (origins, tasks, tuple(human[k] for k in origins), tuple(human[k] for k in tasks))
    return tree, _objective(kind, robot.scaling, pairs)


def _all(robot: RobotHand) -> dict[str, str]:
    return {**robot.tips, **robot.joints}


def _objective(kind: str, scaling: float, pairs: tuple[tuple[int, ...], ...]) -> Objective:
    origins, tasks, human_origins, human_tasks = pairs
    return Objective(
        scaling=scaling,
        kind=kind,
        origins=origins,
        tasks=tasks,
        human_origins=human_origins,
        human_tasks=human_tasks,
        free_base=kind == "position",
        second_order=kind != "position",  # with a base that moves, positions are within reach
    )

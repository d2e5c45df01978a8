"""`Variation`: one scene that differs from its demonstration's in place, mass, friction, size or gains."""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.disturbances.randomize import Randomize
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.objects.description import ObjectDescription
from mjx_hand.rigid.gains import Gains


@dataclasses.dataclass(frozen=True)
class Variation:
    """What a scene has that its demonstration's has not.

    Attributes:
        move: of object and support, horizontal (m).
        turn: of both about the vertical through the object (rad).
        mass, friction, size, gains: factors, as in `Randomize`.
    """

    move: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    mass: float = 1.0
    friction: float = 1.0
    size: float = 1.0
    gains: float = 1.0

    @property
    def is_elsewhere(self) -> bool:
        """Whether the object is not where the demonstration has it at any frame, or is of another size."""
        return any(self.move) or self.turn != 0 or self.size != 1


def draw_variations(randomize: Randomize, count: int, seed: int) -> list[list[Variation]]:
    """`randomize.variants` variations for each of `count` demonstrations; the same for the same seed."""
    random, randomize = np.random.default_rng(seed), randomize.scaled()
    moved = round(randomize.moved_share * randomize.variants)
    return [[_draw(randomize, k < moved, random) for k in range(randomize.variants)] for _ in range(count)]


def _draw(randomize: Randomize, moved: bool, random: np.random.Generator) -> Variation:
    direction, distance = random.uniform(0, 2 * np.pi), random.uniform(*randomize.move)
    turn = np.deg2rad(random.uniform(*randomize.turn_deg)) * random.choice((-1, 1))
    size = random.uniform(*randomize.size)
    mass, friction, gains = (
        float(np.exp(random.uniform(*np.log(limits))))
        for limits in (randomize.mass, randomize.friction, randomize.gains)
    )
    if not moved:
        distance, turn, size = 0.0, 0.0, 1.0
    move = (float(distance * np.cos(direction)), float(distance * np.sin(direction)))
    return Variation(move, float(turn), mass, friction, float(size), gains)


def varied_pose(demonstration: Demonstration, variation: Variation) -> Float[np.ndarray, "7"]:
    """Where the object stands at first (m, quaternion wxyz, world)."""
    position, quaternion = demonstration.object_pose[0, :3], demonstration.object_pose[0, 3:]
    orientation = Rotation.from_quat(quaternion, scalar_first=True)
    depth = _depth(demonstration.object, orientation)
    raised = (variation.size - 1) * depth
    place = position + np.array([*variation.move, raised])
    turned = Rotation.from_rotvec([0.0, 0.0, variation.turn]) * orientation
    return np.concatenate([place, turned.as_quat(scalar_first=True)])


def varied_object(description: ObjectDescription, variation: Variation) -> ObjectDescription:
    """The object of a scene with this variation."""
    return dataclasses.replace(
        description,
        size=np.asarray(description.size) * variation.size,
        mass=float(description.mass) * variation.mass,
        friction=float(description.friction) * variation.friction,
        hulls=np.asarray(description.hulls) * variation.size,
    )


def varied_gains(gains: Gains, factor: float) -> Gains:
    """Stiffness, damping and limits times a factor; the hinges' damping goes with the root of their stiffness."""
    return dataclasses.replace(
        gains,
        stiffness=gains.stiffness * factor,
        force_limit=gains.force_limit * factor,
        damping_ratio=gains.damping_ratio * float(np.sqrt(factor)),
        wrist_slide=tuple(value * factor for value in gains.wrist_slide),
        wrist_turn=tuple(value * factor for value in gains.wrist_turn),
    )


def _depth(description: ObjectDescription, orientation: Rotation) -> float:
    """How far the object reaches below its origin (m)."""
    down = orientation.inv().apply([0.0, 0.0, -1.0])  # in the object's axes
    radius, height = float(description.size[0]), float(description.size[1])
    if description.kind == "box":
        return float(np.abs(down) @ description.size)
    if description.kind == "sphere":
        return radius
    if description.kind == "capsule":
        return radius + height * abs(float(down[2]))
    if description.kind == "cylinder":
        return radius * float(np.hypot(down[0], down[1])) + height * abs(float(down[2]))
    return float((np.asarray(description.hulls).reshape(-1, 3) @ down).max())

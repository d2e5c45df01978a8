"""`Recorder`: what the twin did, as a scene file, which training takes."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from envs.live.twin.tabletop import Tabletop
from envs.live.twin.world import World
from mjx_hand.errors import InputError
from mjx_hand.motion.motion import Motion
from mjx_hand.motion.scene import RecordedObject, RecordedScene
from mjx_hand.motion.scene_file import save_scene
from mjx_hand.view.browser.hand_scene import object_mesh

LONGEST = 600.0  # s; a scene of that is some megabytes
_FILES = 1000
_SOURCE = "mjx-hand live"


class Recorder:
    """Gathers frames while it is on: the twin's own, whose fingers are where the object lets them be.

    Args:
        table: with the object.
        shape: coefficients of the hand.
        side: of the hand.
        fps: at which `add` is called.

    Attributes:
        on: whether it gathers.
    """

    def __init__(self, table: Tabletop, shape: Float[np.ndarray, "s"], side: str, fps: float):
        self._table, self._shape, self._side, self._fps = table, shape, side, fps
        # Of a mesh its convex pieces, which are what the hand met.
        self._mesh = object_mesh(table.object) if table.object.kind == "mesh" else (np.zeros((0, 3)), np.zeros((0, 3)))
        self._poses: list[np.ndarray] = []
        self._rotations: list[np.ndarray] = []
        self.on = False

    def begin(self) -> None:
        """Forget what is gathered, and gather anew."""
        self._poses, self._rotations, self.on = [], [], True

    def add(self, world: World, poses: Float[np.ndarray, "17 7"]) -> None:
        """One more frame, while it is on; after the longest time it is full, and off by itself.

        Args:
            world: as it is.
            poses: its `poses`.
        """
        if self.on:
            self._poses.append(poses[[0, -1]])
            self._rotations.append(world.joint_rotations())
            self.on = len(self._poses) < LONGEST * self._fps

    @property
    def frames(self) -> int:
        """How many are gathered."""
        return len(self._poses)

    def end(self) -> RecordedScene | None:
        """What was gathered, None if nothing; nothing more is."""
        poses, rotations = self._poses, self._rotations
        self._poses, self._rotations, self.on = [], [], False
        if not poses:
            return None
        hand, carried = np.stack(poses, axis=1)
        description = self._table.object
        motion = Motion(
            fps=self._fps,
            rotations=np.stack(rotations),
            wrist_position=hand[:, :3],
            wrist_quaternion=hand[:, 3:],
            shape=np.asarray(self._shape, float),
            valid=np.ones(len(hand), bool),
            side=self._side,
            source=_SOURCE,
        )
        found = RecordedObject(
            name=self._table.name,
            kind=description.kind,
            position=carried[:, :3],
            quaternion=carried[:, 3:],
            seen=np.ones(len(hand), bool),
            size=np.zeros(3) if description.kind == "mesh" else np.asarray(description.size, float),
            vertices=np.asarray(self._mesh[0], float),
            faces=np.asarray(self._mesh[1], int),
        )
        up = np.array([0.0, 0.0, 1.0])
        return RecordedScene(fps=self._fps, hands=(motion,), objects=(found,), up=up, source=_SOURCE)


def save_recording(scene: RecordedScene, folder: Path) -> Path:
    """Write a scene as the next `live-NNN.npz` of a folder, which is made where missing; its path.

    Raises:
        InputError: it cannot be written, or the folder is full.
    """
    for number in range(1, _FILES + 1):
        path = folder / f"live-{number:03d}.npz"
        if not path.exists():
            save_scene(scene, path)
            return path
    raise InputError(f"{folder}: holds {_FILES} recordings; move some away, or choose another --out")

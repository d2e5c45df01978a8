"""A picture of a demonstration set: several demonstrations, a row each, at several moments."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import UInt8

from envs.scene import base_rotation, demonstration_spec, wrist_coordinates
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.view.video.camera import Camera
from mjx_hand.view.video.video import render_frames

MOMENTS = (0.02, 0.2, 0.35, 0.5, 0.7, 0.98)  # shares of a demonstration's length


def contact_sheet(
    demonstrations: Sequence[Demonstration], hands: Sequence[RigidHand], rows: int = 4, size: int = 240
) -> UInt8[np.ndarray, "h w 3"]:
    """The twin as demonstrated, without physics, at `MOMENTS` of `rows` demonstrations spread over the set.

    Args:
        demonstrations: the set, or a part of it.
        hands: the twin's hand for each.
        rows: how many demonstrations; a smaller set shows all.
        size: of each picture (pixels, even).

    Raises:
        RendererUnavailable: there is no way to render on this machine.
    """
    chosen = np.unique(np.linspace(0, len(demonstrations) - 1, rows).round().astype(int))
    strips = []
    for k in chosen:
        d = demonstrations[k]
        wrist = wrist_coordinates(d.motion.wrist_position, d.motion.wrist_quaternion, base_rotation(d))
        qpos = np.concatenate([wrist, d.motion.angles, d.object_pose], axis=1)
        moments = (np.array(MOMENTS) * (d.num_frames - 1)).round().astype(int)
        model = demonstration_spec(d, hands[k], visual=True).compile()
        camera = Camera(distance=0.5)
        strips.append(np.concatenate(list(render_frames(model, qpos[moments], camera, size=(size, size))), axis=1))
    return np.concatenate(strips)

"""From a recording of a human hand to a physics twin of that hand.

    hand = mjx_hand.load_hand()
    rigid = mjx_hand.build_rigid_hand(hand)
    motion = mjx_hand.load_motion("recording.npz")
    angles = mjx_hand.project(motion.rotations, rigid)
    rotations = mjx_hand.joint_rotations(angles, rigid)

Metres, radians, seconds; quaternions wxyz; MANO's joint order and right-hand frame (`mjx_hand.hand`).
"""

from mjx_hand.capture.load import load_motion
from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.capture.marker_fit.fit import fit_markers
from mjx_hand.capture.markers.marker_set import load_marker_set
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.projection import fit_functional_axes, project
from mjx_hand.retarget.dataset import retarget_dataset
from mjx_hand.retarget.options import RetargetOptions
from mjx_hand.retarget.sequence import retarget_sequence
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import joint_rotations

__version__ = "0.2.0"

__all__ = [
    "InputError",
    "RetargetOptions",
    "__version__",
    "build_rigid_hand",
    "fit_functional_axes",
    "fit_markers",
    "joint_rotations",
    "load_hand",
    "load_marker_set",
    "load_markers",
    "load_motion",
    "project",
    "retarget_dataset",
    "retarget_sequence",
]

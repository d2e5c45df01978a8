"""The data that crosses walls: recorded motions, joint motions and their files."""

from mjx_hand.motion.joint_motion import JointMotion, load_joint_motion, save_joint_motion
from mjx_hand.motion.motion import Motion, check_motion, load_motion_file, save_motion

__all__ = [
    "JointMotion",
    "Motion",
    "check_motion",
    "load_joint_motion",
    "load_motion_file",
    "save_joint_motion",
    "save_motion",
]

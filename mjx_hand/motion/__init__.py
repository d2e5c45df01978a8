"""The data that crosses walls: recorded motions, joint motions, demonstrations and their files."""

from mjx_hand.motion.demonstration import Demonstration, load_demonstration, save_demonstration
from mjx_hand.motion.joint_motion import JointMotion, load_joint_motion, save_joint_motion
from mjx_hand.motion.motion import Motion, check_motion, load_motion_file, save_motion
from mjx_hand.objects.description import ObjectDescription

__all__ = [
    "Demonstration",
    "JointMotion",
    "Motion",
    "ObjectDescription",
    "check_motion",
    "load_demonstration",
    "load_joint_motion",
    "load_motion_file",
    "save_demonstration",
    "save_joint_motion",
    "save_motion",
]

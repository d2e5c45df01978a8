"""The data that crosses walls: recorded motions, joint motions, demonstrations and their files."""

from mjx_hand.motion.demonstration import Demonstration, load_demonstration, save_demonstration
from mjx_hand.motion.joint_motion import JointMotion, load_joint_motion, save_joint_motion
from mjx_hand.motion.make_scene import make_scene, recorded_object
from mjx_hand.motion.motion import Motion, check_motion, load_motion_file, save_motion
from mjx_hand.motion.scene import RecordedObject, RecordedScene
from mjx_hand.motion.scene_file import load_scene_file, save_scene
from mjx_hand.objects.description import ObjectDescription

__all__ = [
    "Demonstration",
    "JointMotion",
    "Motion",
    "ObjectDescription",
    "RecordedObject",
    "RecordedScene",
    "check_motion",
    "load_demonstration",
    "load_joint_motion",
    "load_motion_file",
    "load_scene_file",
    "make_scene",
    "recorded_object",
    "save_demonstration",
    "save_joint_motion",
    "save_motion",
    "save_scene",
]

"""An object's way and a hand's where they disagree: no grasp joins them, and each is measured as badly as the other.

A hand that has an object firmly stays where it is beside it. Where cameras show the two drifting apart, half of that is
taken from each, and an object whose turn about its axis was not seen turns with the hand. Where the object rests it
stays: a table says more.
"""

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from envs.demonstrations.from_recording.grasp_pose import GraspPose, spins
from envs.demonstrations.from_recording.observed import ObservedSequence
from envs.demonstrations.observation.settled_path import held_rotation
from mjx_hand.motion.smooth import smooth_rows
from mjx_hand.smoothstep import smoothstep

_HALF = 0.5  # of what they disagree by is the object's
_FADE = 0.4  # s from a rest on
_SPIN = 2.0  # Hz of the filter on the object's turn
_ROUNDS, _STEPS = 3, 50


def shared_way(
    observed: ObservedSequence, lifted: int, corners: Float[np.ndarray, "c 3"], *, rests: bool, spun: bool
) -> tuple[ObservedSequence, Float[np.ndarray, "3"]]:
    """The same with the object nearer to the hand that carries it, and the wrist's place in the object's frame (m).

    Args:
        observed: hand and object, whose z axis is up where it rests; carried from frame `lifted` to the end.
        lifted: the first frame in which it is.
        corners: of the object (m).
        rests: whether it rests after the last frame.
        spun: whether its turn about z was not seen.
    """
    fps = 1 / (observed.times[1] - observed.times[0])
    share = _shares(len(observed.times), lifted, fps, rests)[:, None]
    rotation = observed.rotation
    wrist = _wrist(observed, lifted)
    for _ in range(_ROUNDS if spun else 0):
        into = np.swapaxes(observed.hand_rotation, 1, 2)
        lies = into @ rotation
        mean, _ = held_rotation(Rotation.from_matrix(lies[lifted:]))
        held = GraspPose(observed.angles[lifted], mean.as_matrix(), -mean.apply(wrist))
        place = np.einsum("tij,tj->ti", into, observed.position - observed.hand_position)
        turn = np.unwrap(spins(GraspPose(observed.angles, lies, place)[lifted:], held))
        turn = smooth_rows(turn[:, None], fps, _SPIN) * share[lifted:]
        back = Rotation.from_rotvec(-turn * [0.0, 0.0, 1.0]).as_matrix()
        rotation = np.concatenate([rotation[:lifted], rotation[lifted:] @ back])
        observed = dataclasses.replace(observed, rotation=rotation)
        wrist = _wrist(observed, lifted)
    apart = observed.position + rotation @ wrist - observed.hand_position
    position = observed.position - _HALF * share * apart
    lowest = position[:, 2] + (rotation[:, 2] @ corners.T).min(axis=1)
    position[lifted:, 2] += np.maximum(-lowest, 0.0)[lifted:]
    return dataclasses.replace(observed, position=position), wrist


def _wrist(observed: ObservedSequence, lifted: int) -> Float[np.ndarray, "3"]:
    """The place beside the object to which the hand that carries it is nearest on average: its geometric median."""
    rows = np.einsum("tji,tj->ti", observed.rotation, observed.hand_position - observed.position)[lifted:]
    middle = np.median(rows, axis=0)
    for _ in range(_STEPS):
        weight = 1 / np.maximum(np.linalg.norm(rows - middle, axis=1), 1e-6)
        middle = weight @ rows / weight.sum()
    return middle


def _shares(frames: int, lifted: int, fps: float, rests: bool) -> Float[np.ndarray, "t"]:
    """0 while the object rests, 1 from 0.4 s after that on and until as long before it rests again."""
    frame = np.arange(frames)
    off = (frame - lifted) / fps
    if rests:
        off = np.minimum(off, (frames - 1 - frame) / fps)
    return smoothstep(off / _FADE)

"""Hypothesis strategies for the data that crosses walls."""

import dataclasses

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mjx_hand.motion import JointMotion, Motion


@st.composite
def motions(draw: st.DrawFn, max_frames: int = 8) -> Motion:
    """Any well-formed motion; gaps hold the identity."""
    frames = draw(st.integers(1, max_frames))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    valid = np.array(draw(st.lists(st.booleans(), min_size=frames, max_size=frames)))
    valid[draw(st.integers(0, frames - 1))] = True
    rotations = Rotation.random(frames * 15, rng=rng).as_matrix().reshape(frames, 15, 3, 3)
    rotations[~valid] = np.eye(3)
    return Motion(
        fps=draw(st.floats(0.5, 500)),
        rotations=rotations,
        wrist_position=rng.normal(size=(frames, 3)),
        wrist_quaternion=Rotation.random(frames, rng=rng).as_quat(scalar_first=True),
        shape=rng.normal(size=draw(st.integers(0, 12))),
        valid=valid,
        link_offset=draw(st.sampled_from([None, rng.normal(size=(16, 3))])),
        side=draw(st.sampled_from(["right", "left"])),
        source=draw(st.text(max_size=20).filter(lambda s: "\x00" not in s)),
    )


@st.composite
def joint_motions(draw: st.DrawFn) -> JointMotion:
    """Any well-formed joint motion."""
    m = draw(motions())
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return JointMotion(
        fps=m.fps,
        angles=rng.normal(size=(m.num_frames, 20)),
        wrist_position=m.wrist_position,
        wrist_quaternion=m.wrist_quaternion,
        valid=m.valid,
        side=m.side,
        source=m.source,
    )


def assert_same(a, b) -> None:
    """Two pytree dataclasses hold the same values, array by array, bit by bit."""
    assert vars(a).keys() == vars(b).keys()
    for name, value in vars(a).items():
        other = getattr(b, name)
        if dataclasses.is_dataclass(value):
            assert_same(value, other)
        elif isinstance(value, np.ndarray):
            assert value.dtype == other.dtype
            np.testing.assert_array_equal(value, other, err_msg=name)
        else:
            assert value == other, name

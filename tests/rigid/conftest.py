"""The open hand made rigid, both sides, and its descriptions on disk."""

from pathlib import Path

import numpy as np
import pytest

from mjx_hand.hand.load import load_hand
from mjx_hand.hand.model import HandModel
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.export.mjcf import write_mjcf
from mjx_hand.rigid.export.urdf import write_urdf
from mjx_hand.rigid.rigid_hand import RigidHand

SHAPE = np.array([1.5, -1.0, 0.5, 2.0])  # not the mean, so that tests see the shape space too


@pytest.fixture(scope="session", params=["right", "left"])
def hand(request) -> HandModel:
    return load_hand(side=request.param)


@pytest.fixture(scope="session")
def rigid(hand) -> RigidHand:
    return build_rigid_hand(hand, SHAPE)


@pytest.fixture(scope="session")
def right() -> RigidHand:
    return build_rigid_hand(load_hand(side="right"), SHAPE)


@pytest.fixture(scope="session")
def left() -> RigidHand:
    return build_rigid_hand(load_hand(side="left"), SHAPE)


@pytest.fixture(scope="session")
def folder(rigid, tmp_path_factory) -> Path:
    """A folder with both descriptions, as a user would keep them."""
    folder = tmp_path_factory.mktemp("built") / rigid.side
    write_urdf(rigid, folder)
    write_mjcf(rigid, folder)
    return folder


@pytest.fixture(scope="session")
def angles(rigid) -> np.ndarray:
    """Random hinge angles within the limits, (4, 20)."""
    rng = np.random.default_rng(0)
    return rng.uniform(np.asarray(rigid.hinge_lower), np.asarray(rigid.hinge_upper), (4, 20)).astype(np.float32)

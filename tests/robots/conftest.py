"""A recording that several tests look at."""

import numpy as np
import pytest


@pytest.fixture(scope="session")
def video(recordings) -> np.ndarray:
    return np.load(recordings / "mediapipe_video/joints.npz")["joints"]

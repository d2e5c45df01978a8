"""Two million frames: memory stays flat however large the data set is."""

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mjx_hand.motion import Motion, save_motion

FILES, FRAMES, DIFFERENT = 200, 10_000, 8

PROGRAM = """
import resource, sys, time
from pathlib import Path
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.retarget.dataset import retarget_dataset
from mjx_hand.retarget.options import RetargetOptions
enable_compile_cache()
totals, peaks, began = [], [], time.perf_counter()
def advance(size):
    peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
options = RetargetOptions(carry=True, limits=True)
rows = retarget_dataset(Path(sys.argv[1]), Path(sys.argv[2]), options, began=totals.append, advance=advance)
took = time.perf_counter() - began
print(sum(row.frames for row in rows), took, peaks[len(peaks) // 5], peaks[-1])
"""


@pytest.mark.slow
def test_memory_is_flat_over_two_million_frames(tmp_path):
    for k in range(DIFFERENT):
        turn = 0.3 * np.random.default_rng(k).normal(size=(FRAMES * 15, 3))
        motion = Motion(
            fps=120.0,
            rotations=Rotation.from_rotvec(turn).as_matrix().reshape(FRAMES, 15, 3, 3),
            wrist_position=np.zeros((FRAMES, 3)),
            wrist_quaternion=np.tile([1.0, 0, 0, 0], (FRAMES, 1)),
            shape=np.full(10, 0.1 * k),
            valid=np.ones(FRAMES, bool),
        )
        save_motion(motion, tmp_path / "in" / f"{k:03d}.npz")
    for k in range(DIFFERENT, FILES):
        os.link(tmp_path / "in" / f"{k % DIFFERENT:03d}.npz", tmp_path / "in" / f"{k:03d}.npz")
    where = [str(tmp_path / "in"), str(tmp_path / "out")]
    run = subprocess.run([sys.executable, "-c", PROGRAM, *where], capture_output=True, text=True, check=True)
    frames, seconds, early, late = (float(number) for number in run.stdout.split())
    print(
        f"{frames:,.0f} frames in {seconds:.0f} s; peak memory {early:.0f} MB after a fifth, {late:.0f} MB at the end"
    )
    assert frames == FILES * FRAMES
    assert late < early + 60

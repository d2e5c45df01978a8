import base64
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
FEW = ("data.people=1", "data.heldout_people=1", "data.trials=1", "data.heldout_trials=1")
SHORT = ("ppo.num_timesteps=64", "ppo.num_envs=8", "ppo.unroll_length=8", "checks.every=64")


@pytest.mark.slow
def test_one_command_makes_a_report_with_its_video(tmp_path):
    """From markers to `report.html`: everything that `make demo` does, on one demonstration."""
    command = [sys.executable, "-m", "train.demo", "engine=native", *FEW, *SHORT]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    out = tmp_path / "outputs" / "pinch_demo" / "seed0"
    assert f"report: {out / 'report.html'}" in done.stdout
    made = {"best.npz", "curve.csv", "evaluation.csv", "evaluation.json", "report.html", "retargeted.npz"}
    assert made <= {path.name for path in out.iterdir()}
    page = (out / "report.html").read_text()
    assert "mjx-hand: pinch_demo" in page
    for stage in ("retargeting a recording", "training", "evaluating on held-out demonstrations", "video"):
        assert f"== {stage}\n" in done.stdout
        assert stage in page
    assert page.count("<svg") >= 4
    if not (out / "twin.mp4").exists():
        pytest.skip("no off-screen renderer here; the report says so")
    (film,) = re.findall(r'src="data:video/mp4;base64,([^"]+)"', page)
    assert base64.b64decode(film) == (out / "twin.mp4").read_bytes()

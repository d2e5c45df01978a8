"""The tutorial's robot hand, which the project has no description of, from its page to a model that moves."""

import re
from importlib.util import find_spec
from pathlib import Path

import mujoco
import pytest

from mjx_hand.cli.main import main

PAGE = Path(__file__).resolve().parent.parent / "docs/tutorials/robot_hand.md"


@pytest.mark.skipif(find_spec("dexi_rs") is None, reason="dexi-rs, which carries the hand, is not installed")
def test_the_pages_description_and_command_build_the_hand(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text()
    description = re.search(r"```yaml\n(.*?)```", text, re.DOTALL)
    assert description is not None
    Path("fourier.yaml").write_text(description[1])
    command = re.search(r"^    mjx-hand (robot .*)$", text, re.MULTILINE)
    assert command is not None
    assert main(command[1].split()) == 0
    assert "fourier, right: 6 actuated joints, 5 that follow others" in capsys.readouterr().out
    model = mujoco.MjModel.from_xml_path("fourier/fourier.xml")
    data = mujoco.MjData(model)
    model.opt.gravity[:] = 0
    data.ctrl[6:] = 0.5 * model.actuator_ctrlrange[6:].sum(axis=1)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    finger, tied = (data.joint(f"R_index_{part}_joint").qpos[0] for part in ("proximal", "intermediate"))
    assert abs(finger) > 0.3
    assert tied == pytest.approx(0.975 * finger, abs=0.02)

import dataclasses
import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from envs.observation import observed_features
from envs.task import Task
from mjx_hand.errors import InputError
from mjx_hand.player.exported_policy import load_exported_policy
from mjx_hand.player.tracking_reference import FIELDS
from train.export import export_policy as module
from train.export.__main__ import command_line, full_options
from train.export.export_policy import export_policy
from train.settings.config import Config, compose
from train.settings.options import Export


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_contract_tells_every_number(exported: Path):
    contract = json.loads((exported / "contract.json").read_text())
    policy = load_exported_policy(exported / "policy.npz")
    assert contract == policy.contract
    assert contract["policy"]["digest"] == policy.digest
    start = 0
    for entry, feature in zip(contract["inputs"], observed_features(Task()), strict=True):
        assert (entry["name"], entry["start"], entry["unit"]) == (feature.name, start, feature.unit)
        assert entry["size"] == len(entry["elements"]) == len(entry["scale"]) == len(entry["offset"])
        np.testing.assert_allclose(policy.scale[start : start + entry["size"]], entry["scale"], rtol=1e-6)
        start += entry["size"]
    assert start == policy.offset.size
    assert contract["rate"] == {"control_hz": 50.0, "substeps": 5, "physics_step_s": 0.004}
    assert [len(output["elements"]) for output in contract["outputs"]] == [26, 26]
    assert contract["parity"]["largest_difference"] < 1e-5
    assert {"mjx-hand", "python", "jax", "brax", "mujoco", "numpy"} <= set(contract["versions"])


def test_the_reference_holds_what_the_contract_lists(exported: Path):
    contract = json.loads((exported / "contract.json").read_text())
    (entry,) = contract["demonstrations"]
    assert entry["hand"] == "right"
    with np.load(exported / entry["reference"]) as file:
        listed = contract["demonstration_format"]
        assert set(file.files) == {*listed["arrays"], "schema", "scene"} == {*FIELDS, "schema", "scene"}
        assert str(file["schema"]) == listed["schema"]
        assert len(file["targets"]) == entry["frames"]


def test_the_page_names_every_input(exported: Path):
    contract, page = json.loads((exported / "contract.json").read_text()), (exported / "contract.md").read_text()
    for entry in contract["inputs"]:
        assert f"| {entry['start']} | {entry['size']} | {entry['name']} | {entry['unit']} |" in page
    assert contract["policy"]["digest"] in page


def test_forms_of_one_policy_share_a_folder_and_those_of_another_go(pinch: Config, tmp_path: Path):
    def write(name: str, *to: str) -> set[str]:
        export = Export(to=to, folder=str(tmp_path / "export"), demonstrations=0)
        config = dataclasses.replace(compose([f"config={name}"]), out=str(tmp_path / "none"), export=export)
        export_policy(config)
        return set(contents(tmp_path / "export"))

    contract = {"contract.json", "contract.md"}
    assert write("pinch", "npz") == {*contract, "policy.npz"}
    (tmp_path / "export" / "notes.txt").touch()
    assert write("pinch", "c") == {*contract, "policy.npz", "policy.c", "policy.h", "notes.txt"}
    assert write("power", "npz") == {*contract, "policy.npz", "notes.txt"}
    assert load_exported_policy(tmp_path / "export/policy.npz").contract["policy"]["experiment"] == "power"


def test_an_export_that_fails_leaves_what_was_there(pinch: Config, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    config = dataclasses.replace(pinch, export=Export(folder=str(tmp_path / "export"), demonstrations=0))
    export_policy(config)
    before = contents(tmp_path)

    def broken(*_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module, "contract_page", broken)
    with pytest.raises(InputError, match=r"cannot write .*No space left"):
        export_policy(dataclasses.replace(config, export=dataclasses.replace(config.export, to=("c",))))
    assert contents(tmp_path) == before


def test_a_policy_of_another_task_is_refused(pinch: Config, tmp_path: Path):
    task = dataclasses.replace(pinch.task, lookahead=(1, 4))
    export = Export(folder=str(tmp_path / "export"))
    with pytest.raises(InputError, match=r"holds a training with task\.lookahead=\[1, 4, 12\], now \[1, 4\]"):
        export_policy(dataclasses.replace(pinch, task=task, export=export))
    assert not list(tmp_path.iterdir())


def test_a_file_where_the_folder_should_be(pinch: Config, tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"is a file; choose a folder"):
        export_policy(dataclasses.replace(pinch, export=Export(folder=str(tmp_path / "file"), demonstrations=0)))


def test_onnx_that_is_not_installed_is_named(pinch: Config, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    found = importlib.util.find_spec
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "onnx" else found(name))
    export = Export(to=("onnx",), folder=str(tmp_path / "export"))
    with pytest.raises(InputError, match=r"pip install 'mjx-hand\[export\]'"):
        export_policy(dataclasses.replace(pinch, export=export))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"to": ("tensorrt",)}, r"to is tensorrt; valid: onnx, npz, c"),
        ({"to": ()}, r"to is empty"),
        ({"demonstrations": -1}, r"export\.demonstrations is -1"),
    ],
)
def test_options_that_cannot_be(given, message):
    with pytest.raises(InputError, match=message):
        Export(**given)


def test_the_form_is_a_short_option_of_this_command_alone():
    assert full_options(["config=pinch", "to=onnx,c"]) == ["config=pinch", "export.to=[onnx,c]"]
    assert compose(full_options(["to=c"])).export.to == ("c",)
    with pytest.raises(InputError, match=r"'to' is not an option"):
        compose(["to=c"])


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["export", "config=lateral", "to=npz", "export.demonstrations=0"])
    command_line()
    said = capsys.readouterr().out
    assert "taking the policy that comes with mjx-hand" in said
    assert f"written: {tmp_path / 'outputs/lateral/seed0/export'}" in said
    monkeypatch.setattr(sys, "argv", ["export", "config=lateral", "to=exe"])
    with pytest.raises(SystemExit, match="2"):
        command_line()
    assert capsys.readouterr().err.startswith("train: to is exe; valid: onnx, npz, c")

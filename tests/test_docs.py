"""The documentation builds without a warning, its links lead somewhere, and its tutorials' code runs."""

import importlib
import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from envs.grasps.grasp_type import GraspType
from mjx_hand.capture.datasets.dataset_format import DatasetFormat, Request
from mjx_hand.hand.joints import HINGES, LINKS

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")])
EXTERNAL = ("http://", "https://", "mailto:", "#")


def code(page: str, language: str = "python") -> str:
    """The first block of this language in a tutorial."""
    found = re.search(rf"```{language}\n(.*?)```", (ROOT / "docs/tutorials" / page).read_text(), flags=re.DOTALL)
    assert found
    return found[1]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_and_pictures_are_there(page: Path):
    targets = re.findall(r"\]\(([^)\s]+)\)", page.read_text())
    missing = [t for t in targets if not t.startswith(EXTERNAL) and not (page.parent / t.split("#")[0]).exists()]
    assert not missing


def test_every_page_is_in_the_navigation():
    navigation = (ROOT / "zensical.toml").read_text()
    docs = ROOT / "docs"
    lost = [str(p.relative_to(docs)) for p in docs.rglob("*.md") if f'"{p.relative_to(docs)}"' not in navigation]
    assert not lost


@pytest.mark.parametrize("package", ["mjx_hand", "envs", "train"])
def test_every_public_name_is_in_the_reference(package: str):
    page = (ROOT / f"docs/api/{package}.md").read_text()
    described = {line.rsplit(".", 1)[-1] for line in page.splitlines() if line.startswith("::: ")}
    public = {name for name in getattr(importlib.import_module(package), "__all__", ()) if name != "__version__"}
    assert public <= described


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    if importlib.util.find_spec("zensical") is None:
        pytest.skip("zensical is not installed: pip install 'mjx-hand[docs]'")
    for name in ("docs", "mjx_hand", "envs", "train"):
        shutil.copytree(ROOT / name, tmp_path / name)
    shutil.copy(ROOT / "zensical.toml", tmp_path)
    command = [sys.executable, "-m", "zensical", "build", "--strict"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    reference = (tmp_path / "site/api/mjx_hand/index.html").read_text()
    assert 'id="mjx_hand.projection.project.project"' in reference


def test_the_tutorials_grasp_type_is_complete():
    scope: dict = {}
    exec(compile(code("grasp_type.md"), "tripod.py", "exec"), scope)
    grasp = scope["GRASP"]
    assert isinstance(grasp, GraspType)
    assert len(grasp.posture) == len(HINGES)
    assert {contact.link for contact in grasp.contacts} <= set(LINKS)
    rotation = np.array(grasp.wrist_rotation)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=2e-3)


def test_the_tutorials_data_set_is_read(tmp_path):
    scope: dict = {}
    exec(compile(code("dataset.md"), "my_hands.py", "exec"), scope)
    known = scope["FORMAT"]
    assert isinstance(known, DatasetFormat)
    angles, place = np.zeros((5, 48)), np.tile([0.1, 0.2, 0.3], (5, 1))
    angles[:, 3] = 0.5  # the index finger's base turns about x
    place[2] = np.nan  # a gap
    contents = {"angles": angles, "place": place}
    path = tmp_path / "recording.npz"
    assert known.recognises(path, contents)
    assert not known.recognises(path, {"angles": angles})
    motion = known.read(path, contents, Request())
    np.testing.assert_array_equal(motion.valid, [True, True, False, True, True])
    turned = motion.rotations[0, 0]
    np.testing.assert_allclose(turned[1:, 1:], [[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]], atol=1e-6)
    np.testing.assert_allclose(motion.rotations[0, 1:], np.tile(np.eye(3), (14, 1, 1)))
    assert motion.fps == 60.0

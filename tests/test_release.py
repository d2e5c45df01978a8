"""What a release says of itself agrees: version, changelog, citation."""

import datetime
import re
from pathlib import Path

import yaml

import mjx_hand

ROOT = Path(__file__).resolve().parent.parent
RELEASE = re.compile(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d{2}-\d{2})$", flags=re.MULTILINE)


def test_the_changelogs_last_release_is_this_version():
    text = (ROOT / "CHANGELOG.md").read_text()
    releases = RELEASE.findall(text)
    assert releases[0][0] == mjx_hand.__version__
    dates = [datetime.date.fromisoformat(date) for _, date in releases]
    assert dates == sorted(dates, reverse=True)
    headings = re.findall(r"^## .*$", text, flags=re.MULTILINE)
    assert headings[0] == "## [Unreleased]"
    assert len(headings) == len(releases) + 1  # no heading is misspelt


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    (version, date), *_ = RELEASE.findall((ROOT / "CHANGELOG.md").read_text())
    assert citation["version"] == version == mjx_hand.__version__
    assert str(citation["date-released"]) == date
    assert citation["license"] == "Apache-2.0"


def test_hooks_and_lock_use_one_ruff():
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    locked = re.search(r"^ruff==(\S+)", (ROOT / "requirements.lock").read_text(), flags=re.MULTILINE)
    assert locked
    assert hook["rev"] == f"v{locked[1]}"


def test_hosted_checks_run_what_contributors_run():
    workflow = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())
    test = workflow["jobs"]["test"]
    commands = [step["run"] for step in test["steps"] if "run" in step]
    for target in ("setup", "lint", "types", "test"):
        assert any(command.startswith(f"make {target}") for command in commands)
    pythons = test["strategy"]["matrix"]["python"]
    classifiers = re.findall(r"Python :: (3\.\d+)", (ROOT / "pyproject.toml").read_text())
    assert pythons == classifiers

"""The pinch policy that comes with the project, exported once."""

import dataclasses
import importlib.util
from pathlib import Path

import pytest

from train.experiment.bundled_policies import bundled_policy
from train.export.export_policy import export_policy
from train.settings.config import Config, compose
from train.settings.options import Export


@pytest.fixture(scope="session")
def pinch(tmp_path_factory: pytest.TempPathFactory) -> Config:
    """The experiment, untrained, to be exported in every form that can be written here."""
    folder = tmp_path_factory.mktemp("pinch")
    forms = ("onnx", "npz", "c") if importlib.util.find_spec("onnx") else ("npz", "c")
    config = compose(["config=pinch", "engine=native", f"out={folder}"])
    return dataclasses.replace(config, export=Export(to=forms))


@pytest.fixture(scope="session")
def exported(pinch: Config) -> Path:
    return export_policy(pinch)


@pytest.fixture(scope="session")
def included(pinch: Config) -> Config:
    """The same experiment with its policy named."""
    return dataclasses.replace(pinch, checkpoint=str(bundled_policy("pinch")))

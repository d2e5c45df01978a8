"""What all tests share: shape checks at run time, kept compilations, off-screen rendering, real recordings."""

import gc
import os
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from jaxtyping import install_import_hook

# Before MuJoCo's first import, which reads it: draw without a display. Other systems need no such choice.
if sys.platform == "linux":
    os.environ.setdefault("MUJOCO_GL", "egl")

# Before JAX's first import, and for the processes that tests start: they spend more time compiling than running what is
# compiled, so that it is not worth optimising. XLA's older emitters make code in 40 % of the newer ones' time; jaxlib
# has them up to 0.10, and a later one ends the process when it is given the flag.
_QUICK = ["--xla_backend_optimization_level=0"]
if tuple(int(part) for part in version("jaxlib").split(".")[:2]) < (0, 11):
    _QUICK.append("--xla_cpu_use_fusion_emitters=false")
os.environ["XLA_FLAGS"] = " ".join(filter(None, (os.environ.get("XLA_FLAGS"), *_QUICK)))

# Before any of these packages is imported: every signature's shapes and types are then checked as the tests run.
install_import_hook(["mjx_hand", "envs", "train", "tools"], "beartype.beartype")

from mjx_hand.compile_cache import enable_compile_cache  # noqa: E402

enable_compile_cache()

ROOT = Path(__file__).resolve().parent.parent


# What each of these folders shares (sets, an environment, a training) takes most of a minute to make.
SHARING = ("tests/train/", "tests/envs/")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """`--dist loadfile`, but two workers take one of the folders each, so that nothing is made by both.

    Larger pieces of work come first: single files are left to even out what the workers take.
    """
    if config.getvalue("dist") != "loadfile" or len(config.getvalue("tx") or ()) != 2:
        return None
    from xdist.scheduler import LoadFileScheduling

    class FoldersScheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return next((folder for folder in SHARING if nodeid.startswith(folder)), super()._split_scope(nodeid))

    return FoldersScheduling(config, log)


def pytest_collection_finish() -> None:
    """What is imported stays to the end: the collector need not go through it again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings, which are not part of the project."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no real recordings: {folder} does not exist")
    return folder

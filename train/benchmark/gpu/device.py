"""The GPU, its driver and the host beside it, as far as they tell."""

import os
import shutil
import subprocess
from collections.abc import Sequence

import jax

from envs.physics.native import cores
from train.benchmark.gpu.page import PACKAGES
from train.benchmark.gpu.record import Record
from train.reports.machine import accelerator, processor, versions

_ASKED = ("name", "driver_version", "memory.total", "power.limit", "clocks.max.sm", "mig.mode.current")
_TIMEOUT = 20.0  # seconds
_VARIABLES = ("XLA_FLAGS", "XLA_PYTHON_CLIENT_PREALLOCATE", "XLA_PYTHON_CLIENT_MEM_FRACTION", "WARP_CACHE_PATH")


def describe(record: Record) -> None:
    """Put what is known of the machine into the record."""
    table = record.table("what", "value")
    device = jax.devices()[0]
    table.add("JAX computes on", f"{accelerator() or 'the CPU'} ({device.platform}, {len(jax.devices())} device)")
    table.add("platform, as JAX tells", " ".join(device.client.platform_version.split()))
    answers = ask_gpu(_ASKED)
    for name, answer in zip(_ASKED, answers or ["nvidia-smi does not answer"] * len(_ASKED), strict=True):
        table.add(name, answer)
    table.add("processor", processor())
    table.add("cores", f"{cores()} of {os.cpu_count()}")
    table.add("memory, GiB", round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1))
    for name, number in versions(*PACKAGES).items():
        table.add(name, number)
    for name in _VARIABLES:
        if name in os.environ:
            table.add(name, os.environ[name])


def ask_gpu(fields: Sequence[str]) -> list[str] | None:
    """nvidia-smi's answers on the first GPU; None where it is not there or does not answer."""
    if shutil.which("nvidia-smi") is None:
        return None
    query = ["nvidia-smi", f"--query-gpu={','.join(fields)}", "--format=csv,noheader,nounits", "--id=0"]
    try:
        told = subprocess.run(query, capture_output=True, text=True, timeout=_TIMEOUT, check=True).stdout
    except (subprocess.SubprocessError, OSError):
        return None
    answers = [answer.strip() for answer in told.strip().split(",")]
    return answers if len(answers) == len(fields) else None


def memory_in_use() -> int | None:
    """MiB of the first GPU that all processes together hold; None where it does not tell."""
    answers = ask_gpu(["memory.used"])
    return int(answers[0]) if answers and answers[0].isdigit() else None

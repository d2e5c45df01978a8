"""What a measurement ran on."""

import os
import platform
from importlib.metadata import version
from pathlib import Path

import jax

from envs.physics.native import cores

_CPUINFO = Path("/proc/cpuinfo")  # Linux alone


def processor() -> str:
    """The CPU's name, as far as the system tells."""
    lines = _CPUINFO.read_text().splitlines() if _CPUINFO.is_file() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def accelerator() -> str | None:
    """The name of the GPU or TPU that JAX computes on, None where it computes on the CPU."""
    return None if jax.default_backend() == "cpu" else jax.devices()[0].device_kind


def versions(*packages: str) -> dict[str, str]:
    """Python's and the packages' versions."""
    return {"Python": platform.python_version(), **{name: version(name) for name in packages}}


def machine(*packages: str) -> list[str]:
    """Hardware and versions as lines of text."""
    return [
        f"{processor()}, {cores()} of {os.cpu_count()} cores; JAX on {accelerator() or 'the CPU'}",
        ", ".join(f"{name} {number}" for name, number in versions(*packages).items()),
    ]

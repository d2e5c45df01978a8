import os
import socket
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.train.commands import arguments
from train.settings.config import Config


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("localhost", 0))
        return listener.getsockname()[1]


@pytest.mark.slow
def test_two_processes_are_two_devices(tiny: Config, tmp_path: Path):
    """Bit for bit: how devices are spread over processes does not matter."""
    together = f"localhost:{free_port()}"
    shared, alone = tmp_path / "processes", tmp_path / "devices"
    commands = [
        (arguments(tiny, shared, processes=2, process=0, coordinator=together), {}),
        (arguments(tiny, shared, processes=2, process=1, coordinator=together), {}),
        (arguments(tiny, alone), {"XLA_FLAGS": f"{os.environ['XLA_FLAGS']} --xla_force_host_platform_device_count=2"}),
    ]
    running = [
        subprocess.Popen(command, env=os.environ | extra, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        for command, extra in commands
    ]
    said = [process.communicate()[0] for process in running]
    assert [process.returncode for process in running] == [0, 0, 0], "\n".join(text[-1500:] for text in said)
    assert "success" in said[0]
    assert "success" not in said[1], "the first process speaks alone"
    for name in ("best.npz", "last.npz"):
        with np.load(shared / name) as one, np.load(alone / name) as other:
            assert set(one) == set(other)
            for key in one:
                np.testing.assert_array_equal(one[key], other[key])

"""A process of another environment that answers requests, a JSON line each."""

import contextlib
import json
import subprocess
from pathlib import Path
from types import TracebackType
from typing import Any

from mjx_hand.errors import InputError

WORKER = Path(__file__).with_name("mjbatch_worker.py")
INSTALL = "python -m venv ENV && ENV/bin/pip install mjbatch, then --python ENV/bin/python"


class MjbatchProcess:
    """`mjbatch` in its own environment, until the `with` block ends; `versions` says what is installed there.

    Args:
        python: the environment's interpreter.
        folder: where the process runs and may write.

    Raises:
        InputError: there is no such interpreter, or `mjbatch` is not installed for it.
    """

    def __init__(self, python: Path, folder: Path):
        self._python = python
        self._errors = folder / "errors.txt"
        try:
            # -I: neither this project's modules, one of which is called mjbatch as well, nor PYTHONPATH.
            with self._errors.open("w") as errors:
                self._process = subprocess.Popen(
                    [str(python.absolute()), "-I", str(WORKER)],
                    cwd=folder,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=errors,
                    text=True,
                )
        except OSError as error:
            raise InputError(
                f"cannot run {python}: {error.strerror}; make an environment with mjbatch: {INSTALL}"
            ) from None
        try:
            self.versions: dict[str, str] = self._reply()
        except InputError as error:
            self._close()
            raise InputError(f"{error}; make an environment with mjbatch: {INSTALL}") from None

    def __enter__(self) -> "MjbatchProcess":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._close()

    def ask(self, **request: Any) -> Any:
        """The reply to a request.

        Raises:
            InputError: the process ended instead of replying.
        """
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # of a process that has ended; why stands in its errors
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        return self._reply()

    def _reply(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if line:
            return json.loads(line)
        self._process.wait()
        said = self._errors.read_text().strip().splitlines() or [f"status {self._process.returncode}"]
        raise InputError(f"{self._python} stopped: {said[-1]}")

    def _close(self) -> None:
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None and not pipe.closed:
                with contextlib.suppress(BrokenPipeError):  # what was not sent has no reader any more
                    pipe.close()
        self._process.wait()

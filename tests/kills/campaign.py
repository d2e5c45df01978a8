"""SIGKILL at random moments of a command, which then has to end as if nothing had happened.

    python -m tests.kills.campaign training|retarget|demonstrations COUNT [SEED]

The command is run once to its end. Then it is killed COUNT times: once in four times while it starts, else while it
works. After every few kills it is run to its end, and its folder is compared with that of the run that nothing
stopped: the same files, of the same contents but for what tells the time, and no others; nor others in the folders of
temporary files and of kept arrays.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.kills.commands import KINDS
from tests.kills.contents import below, contents, signs

_IN_A_ROW = 5  # kills, at most, before the command is run to its end
_STARTING = 0.25  # share of the kills
_PATIENCE = 600.0  # s for a run to its end


class Series:
    """A command of one kind, and a folder for all that it reads and writes."""

    def __init__(self, kind: str, folder: Path):
        self.folder = folder
        for name in ("in", "tmp", "cache"):
            (folder / name).mkdir()
        self.command = KINDS[kind](folder / "in")
        self.environment = os.environ | {
            "MJX_HAND_CACHE": str(folder / "cache"),
            "TMPDIR": str(folder / "tmp"),
            "XLA_FLAGS": "--xla_backend_optimization_level=0",  # as in all tests: compiling is what takes long
        }

    def run(self, out: Path, starting: float = _PATIENCE, working: float = _PATIENCE) -> tuple[bool, float, float]:
        """Start it, and kill it so many seconds after its start or its first sign of work, if it has not ended before.

        Returns whether it was killed, and the seconds until that sign, and from then on.
        """
        before = signs(out)
        began = worked = time.monotonic()
        with (self.folder / "log").open("wb") as log:
            process = subprocess.Popen(self.command(out), stdout=log, stderr=log, env=self.environment)
        try:
            while process.poll() is None and not signs(out) - before and time.monotonic() < began + starting:
                time.sleep(0.05)
            worked = time.monotonic()
            process.wait(min(working, max(began + starting - worked, 0.0)))
        except subprocess.TimeoutExpired:
            pass
        finally:
            process.kill()
            status = process.wait()
        assert status in (0, -signal.SIGKILL), (self.folder / "log").read_text()[-2000:]
        return status != 0, worked - began, time.monotonic() - worked

    def whole(self, out: Path) -> tuple[float, float]:
        """Run it to its end; the seconds until it works, and of its work."""
        killed, start, work = self.run(out)
        assert not killed, f"not at its end after {_PATIENCE} s"
        return start, work

    def left(self) -> list[str]:
        """Temporary files, and kept arrays that are half written."""
        hidden = [path for path in below(self.folder / "cache") if path.name.startswith(".")]
        return sorted(path.name for path in [*below(self.folder / "tmp"), *hidden])


def main(kind: str, count: int, seed: int = 0) -> int:
    """Run and print; the exit status is 1 where a result is another."""
    draw = random.Random(seed)
    kills = working = runs = faults = 0
    with tempfile.TemporaryDirectory() as name:
        series = Series(kind, Path(name))
        series.whole(series.folder / "first")  # what is compiled is there from now on
        start, work = series.whole(series.folder / "whole")
        wanted = contents(series.folder / "whole")
        print(f"{kind}: {start:.1f} s until it works, {work:.1f} s of work, {len(wanted)} files", flush=True)
        out = series.folder / "out"
        while kills < count:
            row = min(draw.randint(1, _IN_A_ROW), count - kills)
            for _ in range(row):
                starting = draw.random() < _STARTING
                # Of a command that goes on, each has a part of the work before it.
                moment = {"starting": draw.uniform(0, start)} if starting else {"working": draw.uniform(0, work / row)}
                killed, *_ = series.run(out, **moment)
                if not killed:
                    break
                kills, working = kills + 1, working + (not starting)
            else:
                series.whole(out)
            found = contents(out)
            others = sorted(each for each in wanted | found if wanted.get(each) != found.get(each)) + series.left()
            runs, faults = runs + 1, faults + bool(others)
            told = f"{kills} kills ({working} at work), {runs} times run to its end, {faults} times not the same"
            print(f"{kind}: {told} {' '.join(others)}", flush=True)
            shutil.rmtree(out)
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], *map(int, sys.argv[2:])))

"""The side of the `mjbatch` benchmark that runs in an environment of its own: `python -I FILE`, requests on its input.

It knows nothing of the project: MuJoCo, NumPy and mjbatch are all that it imports. Requests and replies are JSON, a
line each. It says at once which versions it has; then it is told to

- `make` worlds out of files that `train.benchmark.exchange` wrote, and answers with the names of the numbers that its
  MuJoCo would have compiled otherwise, and of those that it has no place for;
- `run` what it made last under a name for a number of passes, and answers with the seconds that they took;
- say where a pass `end`s.
"""

import importlib
import json
import sys
import time
from importlib.metadata import version

import mujoco
import numpy as np

_SAME = 1e-4  # of a field's greatest number; MJCF is written with six digits


def load_model(scene, numbers):
    """The scene compiled by this MuJoCo, with the first model's numbers.

    Args:
        scene: path of the MJCF.
        numbers: fields of `MjModel`, and of its options as `opt.NAME`; one row per model.

    Returns:
        The model; names of fields that differ between models, of fields that it had compiled otherwise, and of fields
        that it does not know.
    """
    model = mujoco.MjModel.from_xml_path(scene)
    varying, otherwise, unknown = [], [], []
    for name, rows in numbers.items():
        owner, field = (model.opt, name[4:]) if name.startswith("opt.") else (model, name)
        if not hasattr(owner, field):
            unknown.append(name)
            continue
        compiled = np.asarray(getattr(owner, field))
        if compiled.shape != rows.shape[1:]:
            raise ValueError(f"{name} has shape {compiled.shape} here and {rows.shape[1:]} there")
        if owner is model and not np.allclose(compiled, rows[0], rtol=0, atol=_SAME * np.abs(rows[0]).max()):
            otherwise.append(name)
        if compiled.shape:
            compiled[...] = rows[0]
        else:
            setattr(owner, field, rows[0].item())
        if (rows != rows[:1]).any():
            varying.append(name)
    return model, varying, otherwise, unknown


class Worlds:
    """Worlds that `mjbatch` steps through a script.

    Args:
        scene, numbers, script: paths.
        threads: how many step.
        forward: end each control step with `mj_forward`, so that sensors belong to the state that it leads to.
    """

    def __init__(self, scene, numbers, script, threads, forward):
        mjbatch = importlib.import_module("mjbatch")  # here, so that what reads models is tested without it
        with np.load(numbers) as numbers, np.load(script) as script:
            model, varying, *self.odd = load_model(scene, dict(numbers))
            self.batch = mjbatch.Batch(model, num_sims=len(script["variant"]), num_threads=threads, forward=forward)
            for name in varying:
                self.batch.expand(name)[...] = numbers[name][script["variant"]]
            for name in ("qpos", "qvel"):
                self.batch.bind(name)[...] = script[name]
            self.controls, self.substeps = script["controls"], int(script["substeps"])
        self.state, self.ctrl = self.batch.bind("state"), self.batch.bind("ctrl")
        self.batch.bind("sensordata")
        self.start = self.state.copy()

    def run(self, passes):
        """Seconds of wall and of CPU time."""
        wall, cpu = time.perf_counter(), time.process_time()
        for _ in range(passes):
            self.state[...] = self.start
            for control in self.controls:
                self.ctrl[...] = control
                self.batch.step(nstep=self.substeps)
        return time.perf_counter() - wall, time.process_time() - cpu

    def end(self):
        """The generalised positions that a pass leads to, one row per world."""
        self.run(1)
        return self.batch.bind("qpos").tolist()


def main():
    """Serve requests until the input ends."""
    made = {}
    print(json.dumps({"mjbatch": version("mjbatch"), "mujoco": version("mujoco")}), flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        name = request.pop("name")
        if request["do"] == "make":
            made[name] = Worlds(**{key: value for key, value in request.items() if key != "do"})
            reply = made[name].odd
        elif request["do"] == "run":
            reply = made[name].run(request["passes"])
        else:
            reply = made[name].end()
        print(json.dumps(reply), flush=True)


if __name__ == "__main__":
    main()

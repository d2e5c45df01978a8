"""Train what is not trained yet, evaluate it, and write all results on one page: `make results`.

    mjx-hand results [names=[power,pinch]] [seeds=[0,1,2]] [results=FOLDER] [any override of train.ppo]

Without `names` the paper's five grasp types; any experiment of `configs/config` may be named. Overrides, such as
`ppo.num_timesteps=300000`, hold for all of them. Writes `index.html`, `results.md` and `results.json` to `results`
(outputs/results) after each experiment. Grasp types are measured on their sealed part, which is made for that alone;
`part=heldout` names another. Policies are tested under disturbances as well, unless `stress=false` is given. What was
trained and evaluated before with the same settings is kept, so that the same command resumes where it was stopped.
"""

import dataclasses
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from envs.demonstrations.load_set import SEALED
from envs.grasps import FIVE, grasp_names
from mjx_hand.errors import InputError
from train.experiment.evaluate_seeds import shared_folder
from train.experiments import SEEDS, measure, run_command, taken
from train.reports.results_page import write_results_page
from train.reports.results_table import Experiment
from train.settings.config import Config, compose_seeds
from train.settings.overrides import listed

FOLDER = "outputs/results"


def main(argv: Sequence[str] | None = None) -> int:
    """Train, evaluate and write; see `run_command`."""
    return run_command("results", str(__doc__), argv, _results)


def _results(argv: Sequence[str]) -> Path:
    experiments, folder = plan(argv)
    command = shlex.join(["python", "-m", "train.results", *argv])
    done: list[Experiment] = []
    for k, configs in enumerate(experiments):
        print(f"\n== {configs[0].name} ({k + 1} of {len(experiments)})", flush=True)
        done.append(measure(configs))
        waiting = [later[0].name for later in experiments[k + 1 :]]
        write_results_page(done, waiting, folder, command)
    return folder / "index.html"


def plan(argv: Sequence[str]) -> tuple[list[list[Config]], Path]:
    """The configurations of every experiment, one a seed, and the folder of the page.

    Raises:
        InputError: what cannot be used, before anything is trained.
    """
    own, overrides = taken(argv, ("names", "results"))
    if not any(a.startswith(("seed=", "seeds=")) for a in overrides):
        overrides.append(SEEDS)
    if not any(a.startswith("stress=") for a in overrides):
        overrides.append("stress=true")
    experiments = [compose_seeds([f"config={name}", *overrides]) for name in listed(own, "names", FIVE)]
    if not any(a.startswith("part=") for a in overrides):
        experiments = [[dataclasses.replace(c, part=_part(c)) for c in configs] for configs in experiments]
    folders = [shared_folder(configs) for configs in experiments]
    if len(set(folders)) < len(folders):
        raise InputError(f"out puts several experiments into {folders[0]}; put ${{name}} into it")
    return experiments, Path(own.get("results") or FOLDER)


def _part(config: Config) -> str:
    """The part of an experiment's demonstrations that results are of: the sealed one, if it has one."""
    sets = config.data.expand_types() or (config.data,)
    return SEALED if all(single.grasp in grasp_names() for single in sets) else config.part


if __name__ == "__main__":
    sys.exit(main())

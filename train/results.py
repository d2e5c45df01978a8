"""`make results`: train what is not trained yet, evaluate it, and write all results on one page.

    python -m train.results [names=[power,pinch]] [seeds=[0,1,2]] [results=FOLDER] [any override of train.ppo]

Without `names` the paper's five grasp types; any experiment of `configs/config` may be named. Overrides, such as
`ppo.num_timesteps=300000`, hold for all of them. Writes `index.html`, `results.md` and `results.json` to `results`
(outputs/results) after each experiment. What was trained and evaluated before with the same settings is kept, so that
the same command goes on where it was stopped.
"""

import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError
from train.config import Config, compose_seeds
from train.curve import is_finished, load_curve
from train.evaluate import evaluate_and_write
from train.evaluation_record import kept_results
from train.experiment import make_world
from train.ppo import train
from train.results_page import write_results_page
from train.results_table import FIVE, Experiment
from train.seeds import shared_folder

SEEDS = "seeds=[0,1,2]"
FOLDER = "outputs/results"


def main(argv: Sequence[str] | None = None) -> int:
    """Train, evaluate and write; returns the exit status: 0, or 2 for input that cannot be used.

    Args:
        argv: the arguments; the process's own if None.
    """
    argv = sys.argv[1:] if argv is None else argv
    if {"-h", "--help"} & set(argv):
        print(__doc__)
        return 0
    try:
        enable_compile_cache()
        experiments, folder = plan(argv)
        command = shlex.join(["python", "-m", "train.results", *argv])
        done: list[Experiment] = []
        for k, configs in enumerate(experiments):
            print(f"\n== {configs[0].name} ({k + 1} of {len(experiments)})", flush=True)
            done.append(measure(configs))
            waiting = [later[0].name for later in experiments[k + 1 :]]
            write_results_page(done, waiting, folder, command)
        print(f"\nresults: {(folder / 'index.html').resolve()}  (open it in a browser), results.md and results.json")
    except InputError as error:
        print(f"results: {error}", file=sys.stderr)
        return 2
    return 0


def plan(argv: Sequence[str]) -> tuple[list[list[Config]], Path]:
    """The configurations of every experiment, one a seed, and the folder of the page.

    Raises:
        InputError: what cannot be used, before anything is trained.
    """
    own, overrides = taken(argv, ("names", "results"))
    if not any(a.startswith(("seed=", "seeds=")) for a in overrides):
        overrides.append(SEEDS)
    experiments = [compose_seeds([f"config={name}", *overrides]) for name in listed(own, "names", FIVE)]
    folders = [shared_folder(configs) for configs in experiments]
    if len(set(folders)) < len(folders):
        raise InputError(f"out puts several experiments into {folders[0]}; put ${{name}} into it")
    return experiments, Path(own.get("results") or FOLDER)


def taken(argv: Sequence[str], keys: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """The arguments of these keys, which are the command's own, and the others, which are overrides.

    Raises:
        InputError: an override that chooses the experiment.
    """
    own = {key: value for key, _, value in (a.partition("=") for a in argv) if key in keys}
    overrides = [a for a in argv if a.partition("=")[0] not in own]
    if any(a.startswith("config=") for a in overrides):
        raise InputError("experiments are chosen with names=[...] here, such as names=[pinch]; leave out config=")
    return own, overrides


def listed(own: Mapping[str, str], key: str, otherwise: Sequence[str]) -> list[str]:
    """The names of an argument such as names=[power,pinch], each once; `otherwise` where it is not given.

    Raises:
        InputError: it names nothing.
    """
    names = [name.strip(" '\"") for name in own[key].strip("[]").split(",")] if key in own else list(otherwise)
    if not all(names):
        raise InputError(f"{key}={own[key]} names nothing; give for example {key}=[{','.join(otherwise)}]")
    return list(dict.fromkeys(names))


def measure(configs: Sequence[Config]) -> Experiment:
    """Train and evaluate one experiment; what was done before with the same settings is taken as it is."""
    finished = all(is_finished(config, load_curve(config.out)) for config in configs)
    folder = shared_folder(configs)
    summary = kept_results(configs) if finished and not configs[0].fresh else None
    if summary is None:
        world = make_world(configs[0], "train")
        for config in configs:
            train(config, world)
        evaluate_and_write(configs)
        summary = kept_results(configs)
        if summary is None:
            raise InputError(f"{folder}: policies changed while they were evaluated; run one command at a time there")
    else:
        print(f"trained and evaluated already ({folder}); anew with fresh=true")
    return Experiment(configs[0].name, folder, summary, {c.seed: load_curve(c.out) for c in configs})


if __name__ == "__main__":
    sys.exit(main())

"""What `train.results` and `train.ablations` share: arguments, how they end, and an experiment's turn in them."""

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from envs.demonstrations.dataset import make_missing_sets
from envs.demonstrations.load_set import SEALED
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError
from train.evaluate import evaluate_and_write
from train.experiment.evaluate_seeds import shared_folder
from train.experiment.setup import training_env
from train.learning.curve import is_finished, load_curve
from train.ppo import train
from train.reports.evaluation_record import cached_results
from train.reports.results_table import Experiment
from train.reports.stress_table import cached_stress
from train.settings.config import Config

SEEDS = "seeds=[0,1,2]"


def run_command(name: str, text: str, argv: Sequence[str] | None, task: Callable[[Sequence[str]], Path]) -> int:
    """Run a command that writes a page.

    Args:
        name: of the command, and of the text and the figures beside the page.
        text: what `--help` says.
        argv: the arguments; the process's own if None.
        task: makes the page of these arguments, and returns it.

    Returns:
        The exit status: 0, 2 for input that cannot be used, or 130 when it was stopped with Ctrl-C.
    """
    argv = sys.argv[1:] if argv is None else argv
    if {"-h", "--help"} & set(argv):
        print(text)
        return 0
    try:
        enable_compile_cache()
        page = task(argv)
    except InputError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2
    except OSError as error:  # a path that the system cannot use: too long a name, no permission, a full disk
        print(f"{name}: {InputError(error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"\n{name}: stopped; the same command goes on from here", file=sys.stderr)
        return 130
    print(f"\n{name}: {page.resolve()}  (open it in a browser), {name}.md and {name}.json")
    return 0


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


def _is_finished(config: Config) -> bool:
    try:
        return is_finished(config, load_curve(config.out))
    except InputError:  # damaged: the training writes it anew
        return False


def measure(configs: Sequence[Config]) -> Experiment:
    """Train and evaluate one experiment; what was done before with the same settings is taken as it is."""
    finished = all(_is_finished(config) for config in configs)
    folder = shared_folder(configs)
    known = _known(configs) if finished and not configs[0].fresh else None
    if known is None:
        data, root = configs[0].data, configs[0].demonstrations
        make_missing_sets(data, root)
        if configs[0].part == SEALED:
            make_missing_sets(data, root, sealed=True)
        env = training_env(configs[0])
        for config in configs:
            train(config, env)
        evaluate_and_write(configs)
        known = _known(configs)
        if known is None:
            raise InputError(f"{folder}: policies changed while they were evaluated; run one command at a time there")
    else:
        print(f"trained and evaluated already ({folder}); anew with fresh=true")
    summary, disturbed = known
    return Experiment(configs[0].name, folder, summary, {c.seed: load_curve(c.out) for c in configs}, disturbed)


def _known(configs: Sequence[Config]) -> tuple[Mapping[str, Any], Mapping[str, Any] | None] | None:
    """What an evaluation of these very policies left on disk, under disturbances too if that is asked for."""
    summary, disturbed = cached_results(configs), cached_stress(configs) if configs[0].stress else None
    return None if summary is None or (configs[0].stress and disturbed is None) else (summary, disturbed)

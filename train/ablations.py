"""What each part of the method is worth, at equal budgets, with three seeds, on one page: `make ablations`.

    mjx-hand ablations [names=[spherical]] [variants=["no grip"]] [results=FOLDER] [any override of train.ppo]

Trains and evaluates every variant of `train/reports/ablations_variants.py`, or those of `variants`, of the experiments
of `names` (spherical, the hardest), 300,000 control steps per training unless ppo.num_timesteps says otherwise.
Overrides hold for all variants alike. Writes `index.html`, `ablations.md` and `ablations.json` to `results`
(outputs/ablations) after each variant, and trainings below it. What was done before with the same settings is kept, so
that the same command resumes where it was stopped.
"""

import dataclasses
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from mjx_hand.errors import InputError
from train.experiments import SEEDS, measure, run_command, taken
from train.reports.ablations_page import Ablation, write_ablations_page
from train.reports.ablations_variants import UNCHANGED, VARIANTS, Variant
from train.reports.results_table import Experiment
from train.settings.config import Config, compose_seeds
from train.settings.overrides import listed

NAMES = ("spherical",)
FOLDER = "outputs/ablations"
BUDGET = ("ppo.num_timesteps=300000", "checks.every=50000")
_SAME_FOR_ALL = "checks.stop_at=2.0"  # never: a training that stopped early would have another budget


@dataclasses.dataclass(frozen=True)
class Plan:
    """An experiment's variants, each with one configuration per seed."""

    name: str
    variants: Sequence[tuple[Variant, Sequence[Config]]]

    @property
    def steps(self) -> int:
        return self.variants[0][1][0].ppo.timesteps


def main(argv: Sequence[str] | None = None) -> int:
    """Train, evaluate and write; see `run_command`."""
    return run_command("ablations", str(__doc__), argv, _ablations)


def _ablations(argv: Sequence[str]) -> Path:
    plans, folder = plan(argv)
    run(plans, folder, shlex.join(["python", "-m", "train.ablations", *argv]))
    return folder / "index.html"


def plan(argv: Sequence[str]) -> tuple[list[Plan], Path]:
    """What to train, by experiment, and the folder of the page.

    Raises:
        InputError: what cannot be used, before anything is trained.
    """
    own, overrides = taken(argv, ("names", "results", "variants"))
    for key, why in (
        ("out", "each variant has a folder of its own below results=FOLDER"),
        ("checks.stop_at", "trainings of equal budgets do not stop early"),
    ):
        if any(override.startswith(f"{key}=") for override in overrides):
            raise InputError(f"{key} cannot be given here: {why}; leave it out")
    given = {override.partition("=")[0] for override in overrides}
    overrides += [default for default in BUDGET if default.partition("=")[0] not in given]
    if not given & {"seed", "seeds"}:
        overrides.append(SEEDS)
    folder = Path(own.get("results") or FOLDER)
    variants = _chosen(listed(own, "variants", [variant.name for variant in VARIANTS]))
    plans = []
    for name in listed(own, "names", NAMES):
        configs = []
        for variant in variants:
            there = folder / name / variant.name.replace(" ", "_").replace("'", "")
            told = [f"config={name}", *overrides, _SAME_FOR_ALL, f"out={there}/seed${{seed}}", *variant.overrides]
            configs.append((variant, compose_seeds(told)))
        plans.append(Plan(name, configs))
    return plans, folder


def run(plans: Sequence[Plan], folder: Path, command: str) -> None:
    """Train and evaluate what is planned, and write the page after each variant.

    Raises:
        InputError: as `train` and `evaluate_and_write`.
    """
    finished: list[Ablation] = []
    for one in plans:
        measured: list[tuple[Variant, Experiment]] = []
        for k, (variant, configs) in enumerate(one.variants):
            print(f"\n== {one.name}, {variant.name} ({k + 1} of {len(one.variants)})", flush=True)
            # A baseline's scores stand in the unchanged experiment's evaluation, which is planned before it.
            measured.append((variant, measure(configs) if variant.learns else measured[0][1]))
            waiting = [later.name for later, _ in one.variants[k + 1 :]]
            write_ablations_page([*finished, Ablation(one.name, one.steps, measured, waiting)], folder, command)
        finished.append(Ablation(one.name, one.steps, measured))


def _chosen(names: Sequence[str]) -> list[Variant]:
    """The variants of these names, in the order of `VARIANTS`, the unchanged experiment always among them."""
    known = [variant.name for variant in VARIANTS]
    for name in names:
        if name not in known:
            raise InputError(f"variant {name!r} is not known; valid: {', '.join(known)}")
    return [variant for variant in VARIANTS if variant == UNCHANGED or variant.name in names]


if __name__ == "__main__":
    sys.exit(main())

"""Evaluate checkpoints on held-out demonstrations: `mjx-hand evaluate config=pinch seeds=[0,1,2]`.

Every rollout counts, from frame 0, unassisted. Beside the policies, the best of each seed, stand baselines without
learning: one constant press for each grasp type, the reference with a residual of zero, and the demonstration replayed
as it is. Writes `evaluation.html`, `evaluation.json`, `evaluation.csv` (one row per rollout), `worst.mp4` and
`median.mp4` to the seed's `out` folder, or to the one above those of several seeds.

With `stress=true` also under disturbances that the policy is not told of (`train.experiment.stress`): a table and
curves on the page, `stress.json` and `stress.csv` (one row per rollout).
"""

from collections.abc import Sequence
from pathlib import Path

from mjx_hand.view.report import Table, print_table, write_report
from train.experiment.evaluate_seeds import evaluate_seeds, shared_folder
from train.experiment.setup import settled
from train.experiment.stress import stress
from train.reports.evaluation_page import evaluation_page, films, tables
from train.reports.evaluation_record import write_results
from train.reports.stress_table import stress_table, write_stress
from train.settings.config import Config, command_with_seeds


def evaluate_and_write(configs: Sequence[Config]) -> tuple[Path, tuple[Table, ...]]:
    """Evaluate one or several seeds of an experiment; the folder of all that was written, and the tables of scores.

    Raises:
        InputError: as `evaluate_seeds`.
    """
    results = evaluate_seeds(configs)
    disturbed = stress(configs) if configs[0].stress else None
    shown = films(results, shared_folder(configs))
    notes = {
        name: {"file": film.path.name if film.path else None, "caption": film.caption, "missing": film.missing}
        for name, film in shown.items()
    }
    out = write_results(results, configs, notes)
    if disturbed is not None:
        write_stress(disturbed, out, configs)
    write_report(out / "evaluation.html", evaluation_page(results, configs, shown, disturbed))
    return out, (*tables(results, configs[0]), *([] if disturbed is None else [stress_table(disturbed)]))


def main(configs: Sequence[Config]) -> None:
    """Evaluate, print the tables, write the files."""
    out, made = evaluate_and_write(configs)
    for table in made:
        print_table(table)
    more = ", stress.json and stress.csv" if configs[0].stress else ""
    print(f"written: {(out / 'evaluation.html').resolve()}, evaluation.json and evaluation.csv{more}")


def command_line() -> None:
    """The command, with this process's arguments."""
    command_with_seeds(main, settled)


if __name__ == "__main__":
    command_line()

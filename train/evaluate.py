"""Evaluate a checkpoint on held-out demonstrations: `python -m train.evaluate config=pinch`.

Every rollout counts, from frame 0, unassisted. Beside the policy stand two baselines without learning: the same
reference with a residual of zero, and the demonstration replayed as it is. Writes `evaluation.json` and
`evaluation.csv` (a row a rollout) to the experiment's `out` folder.
"""

import csv
import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.table import Table as RichTable

from envs.evaluation import Evaluation, evaluate
from envs.published import PAPER
from envs.rolling import make_roll_out, zero_residual
from envs.rollout import Rollouts
from envs.score_table import failure_table, score_table
from mjx_hand.motion.archive import replacing
from mjx_hand.view.report import Table
from train.checkpoint import Checkpoint
from train.config import Config, command
from train.experiment import World, chosen_checkpoint, make_world, without_grip
from train.policy import deterministic_policy

HOLD = 5.0  # s after the demonstration, for the hold metric
POLICY, ZERO, REPLAY = "policy", "zero residual", "demonstration alone"


@dataclasses.dataclass(frozen=True)
class Results:
    """Rollouts and their scores, by column title."""

    world: World
    checkpoint: Checkpoint
    rollouts: Mapping[str, Rollouts]
    evaluations: Mapping[str, Evaluation]


def evaluate_checkpoint(config: Config, part: str = "heldout") -> Results:
    """Roll out policy and baselines on one part of the demonstrations and score them.

    Raises:
        InputError: no checkpoint, or one of another task.
    """
    world = make_world(config, part)
    env = world.env
    checkpoint = chosen_checkpoint(config, env.observation_size)
    policy = deterministic_policy(config.ppo, env.observation_size, env.action_size)
    alone = without_grip(world)
    rollouts = {
        POLICY: make_roll_out(env, world.hands, policy, HOLD)(checkpoint.policy),
        ZERO: make_roll_out(env, world.hands, zero_residual, HOLD)(None),
        REPLAY: make_roll_out(alone.env, world.hands, zero_residual, HOLD)(None),
    }
    objects = [demonstration.object for demonstration in world.demonstrations]
    return Results(world, checkpoint, rollouts, {title: evaluate(r, objects) for title, r in rollouts.items()})


def write_results(results: Results, config: Config) -> None:
    """`evaluation.json` (means) and `evaluation.csv` (every rollout) in the experiment's folder."""
    out = Path(config.out)
    summary = {
        "experiment": config.name,
        "engine": results.world.env.engine.name,
        "checkpoint_steps": results.checkpoint.steps,
        "demonstrations": len(results.world.demonstrations),
        "scores": {title: e.rows() for title, e in results.evaluations.items()},
        "failures": {title: e.failure_shares() for title, e in results.evaluations.items()},
    }
    with replacing(out / "evaluation.json") as temporary:
        temporary.write_text(json.dumps(summary, indent=1) + "\n")
    with replacing(out / "evaluation.csv") as temporary, temporary.open("w", newline="") as file:
        names = list(results.evaluations[POLICY].scores)
        rows = csv.writer(file)
        rows.writerow(["column", "demonstration", *names, "failure"])
        for title, e in results.evaluations.items():
            for k, demonstration in enumerate(e.demonstration):
                rows.writerow([title, int(demonstration), *(f"{e.scores[n][k]:g}" for n in names), e.failure[k]])


def tables(results: Results, config: Config) -> tuple[Table, Table]:
    """Scores with the paper's row beside, and how rollouts failed."""
    count = len(results.world.demonstrations)
    note = (
        f"{count} held-out demonstrations, every rollout counted, from frame 0, unassisted; "
        "the paper does not define its success"
    )
    scores = score_table(results.evaluations, PAPER.get(config.data.grasp), note)
    return scores, failure_table(results.evaluations)


def show(table: Table) -> None:
    """Print a report's table on the terminal."""
    made = RichTable(*table.columns, caption=table.note or None)
    for row in table.rows:
        made.add_row(*row)
    Console().print(made)


def main(config: Config) -> None:
    """Evaluate, print the tables, write the files."""
    results = evaluate_checkpoint(config)
    write_results(results, config)
    for table in tables(results, config):
        show(table)
    print(f"written: {Path(config.out) / 'evaluation.json'} and evaluation.csv")


if __name__ == "__main__":
    command(main)

"""What an evaluation leaves on disk: `evaluation.json` (means, failures) and `evaluation.csv` (every rollout)."""

import csv
import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from envs.demonstrations.load_set import PARTS, SEALED, part_digest
from envs.demonstrations.on_robot import robot_set
from envs.demonstrations.set_settings import fingerprint, sealed_folder, set_folder
from envs.evaluation.evaluate import Evaluation
from envs.evaluation.people import people_of, person_scores
from envs.grasps import Pads, grasp_names, grasp_type
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.files.digests import digest
from mjx_hand.files.npz_archive import replacing
from train.experiment.evaluate_seeds import POLICY, Results, shared_folder
from train.reports.interval import intervals
from train.reports.overlap_table import overlap_scores
from train.reports.type_table import groups, type_scores
from train.settings.config import Config

SCHEMA = "mjx-hand/evaluation/3"  # 2: with the constant press; 3: with intervals and overlaps


def write_results(results: Mapping[int, Results], configs: Sequence[Config], films: Mapping[str, Any]) -> Path:
    """Write both files for one or several seeds, and return their folder.

    Args:
        results: by seed.
        configs: that were evaluated.
        films: notes on the videos beside them, by name.
    """
    out, config, first = shared_folder(configs), configs[0], next(iter(results.values()))
    policies = {seed: result.evaluations[POLICY] for seed, result in results.items()}
    baselines = {title: e for title, e in first.evaluations.items() if title != POLICY}
    grasps = groups(first.env.demonstrations)
    by_type = [type_scores(e, grasps) for e in policies.values()]
    summary = {
        "schema": SCHEMA,
        "experiment": config.name,
        "grasp": config.data.grasp,
        "engine": first.env.engine.name,
        "part": config.part,
        "checkpoint_steps": {seed: result.checkpoint.steps for seed, result in results.items()},
        "demonstrations": len(first.env.demonstrations),
        "scores": {
            POLICY: mean_scores([e.rows() for e in policies.values()]),
            **{t: e.rows() for t, e in baselines.items()},
        },
        "intervals": {
            POLICY: intervals(list(policies.values())),
            **{t: intervals([e]) for t, e in baselines.items()},
        },
        "types": {
            POLICY: {grasp: mean_scores([scores[grasp] for scores in by_type]) for grasp in by_type[0]},
            **{title: type_scores(e, grasps) for title, e in baselines.items()},
        },
        "overlap": {
            POLICY: overlap_scores([result.overlaps[POLICY] for result in results.values()]),
            **{title: overlap_scores([first.overlaps[title]]) for title in baselines},
        },
        "constant_press": dict(first.press),
        "people": person_scores(list(policies.values()), people_of(first.env.demonstrations)),
        "seeds": {seed: e.rows() for seed, e in policies.items()},
        "failures": {
            POLICY: mean_scores([e.failure_shares() for e in policies.values()]),
            **{title: e.failure_shares() for title, e in baselines.items()},
        },
        "failed": [failed for seed, e in policies.items() for failed in _failed(seed, e)],
        "films": films,
        "made_of": evaluation_fingerprint(configs),
    }
    with replacing(out / "evaluation.json") as temporary:
        temporary.write_text(json.dumps(summary, indent=1) + "\n")
    with replacing(out / "evaluation.csv") as temporary, temporary.open("w", newline="") as file:
        names = list(next(iter(policies.values())).scores)
        rows = csv.writer(file)
        rows.writerow(["column", "seed", "demonstration", *names, "failure"])
        every = [(POLICY, seed, e) for seed, e in policies.items()] + [(t, "", e) for t, e in baselines.items()]
        for title, seed, e in every:
            rows.writerows([title, seed, *row] for row in rollout_rows(e, names))
    return out


def rollout_rows(evaluation: Evaluation, names: Sequence[str]) -> Iterator[list[Any]]:
    """A row a rollout: its demonstration, the scores of these names, and why it failed."""
    for k, demonstration in enumerate(evaluation.demonstration):
        scores = (f"{evaluation.scores[name][k]:g}" for name in names)
        yield [int(demonstration), *scores, evaluation.failure[k]]


def cached_results(configs: Sequence[Config]) -> dict[str, Any] | None:
    """The summary of an evaluation of the very same policies with the same settings, None where there is none."""
    summary = made_of(shared_folder(configs) / "evaluation.json", configs)
    return summary if summary and summary.get("films") else None


def made_of(path: Path, configs: Sequence[Config]) -> dict[str, Any] | None:
    """What a file of results says, if it is of the very same policies with the same settings; else None."""
    if not path.is_file():
        return None
    try:
        content = json.loads(path.read_text())
    except (ValueError, RecursionError):  # a file of someone else's: it is written anew
        return None
    return content if isinstance(content, dict) and content.get("made_of") == evaluation_fingerprint(configs) else None


def evaluation_fingerprint(configs: Sequence[Config]) -> str:
    """A digest of all that an evaluation depends on: settings, demonstrations, policies, and the versions."""
    pieces = [f"{SCHEMA} {version('mjx-hand')}".encode()]
    for config in configs:
        parts = [fingerprint(config.data)]
        parts += [dataclasses.asdict(part) for part in (config.task, config.ppo, config.checks)]
        folder = sealed_folder if config.part == SEALED else set_folder
        sets = [folder(settings, config.demonstrations).name for settings in config.data.expand_types()]
        if config.data.folder:
            sets += [part_digest(config.data.folder, part) for part in PARTS]
        types = [grasp_type(name) for name in grasp_names()]
        forces = [grasp.grip_force for grasp in types]
        told = [config.name, config.part, config.engine, config.seed, sets, forces, parts]
        if config.hand != HUMAN:
            pressed = [grasp.closing.force for grasp in types if isinstance(grasp.closing, Pads)]
            told.append([config.hand, robot_set.METHOD, pressed])
        pieces.append(json.dumps(told, sort_keys=True).encode())
        policy = Path(config.checkpoint) if config.checkpoint else Path(config.out) / "best.npz"
        for path in (policy, Path(config.out) / "curve.csv"):
            pieces.append(path.read_bytes() if path.is_file() else b"none")
    return digest(pieces)


def mean_scores(rows: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """The mean of several seeds' scores."""
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def _failed(seed: int, evaluation: Evaluation) -> list[dict[str, Any]]:
    return [
        {
            "seed": seed,
            "demonstration": int(evaluation.demonstration[k]),
            "reason": reason,
            **{n: float(evaluation.scores[n][k]) for n in ("tracking_error_cm", "object_rotation_error_deg")},
        }
        for k, reason in enumerate(evaluation.failure)
        if reason
    ]

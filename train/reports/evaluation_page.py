"""An evaluation as tables, figures and videos, and the page that holds them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import jax
import numpy as np
from matplotlib.figure import Figure

from envs.evaluation.evaluate import Evaluation
from envs.evaluation.metrics import grip_force, position_error
from envs.evaluation.people import people_of, person_scores
from envs.evaluation.rollout import Rollouts
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.view.figures import plots
from mjx_hand.view.report import Film, Headline, Plot, Report, Section, Table
from train.experiment.evaluate_seeds import (
    BASELINES,
    PART_WORDS,
    POLICY,
    PRESS,
    REPLAY,
    ZERO,
    Results,
    median_and_worst,
)
from train.experiment.stress import Stress
from train.reports.evaluation_record import mean_scores
from train.reports.interval import intervals
from train.reports.machine import processor, versions
from train.reports.overlap_table import overlap_table
from train.reports.people_table import people_table
from train.reports.published import PAPER, Published
from train.reports.score_table import demonstration_table, failed_table, failure_table, score_table
from train.reports.stress_table import stress_figure, stress_table
from train.reports.type_table import groups, type_table
from train.settings.config import Config
from train.view.video import film

TRACKING = "Distance of the object from where the demonstration has it."

FORCE = (
    "Sum of the magnitudes of the links' forces on the object, over m g sqrt(1 + μ²) / μ, the least that carries it by "
    "its upright faces."
)


def tables(results: Mapping[int, Results], config: Config) -> tuple[Table, ...]:
    """Scores with the paper's row beside, and how rollouts failed; of several seeds the mean.

    Where the demonstrations are of several grasp types, then also scores by type.
    """
    first = next(iter(results.values()))
    count = len(first.env.demonstrations)
    note = (
        f"{count} {PART_WORDS[config.part]}, every rollout counted, from frame 0, unassisted; "
        f"the paper does not define its success. Constant press: {pressed(first)}"
    )
    columns = {POLICY: [result.evaluations[POLICY] for result in results.values()]}
    columns |= {title: [first.evaluations[title]] for title in BASELINES}
    grasps = _grasps(first)
    by_type = [type_table(columns, grasps)] if len(set(grasps)) > 1 else []
    return score_table(columns, _published(config), note), failure_table(columns), *by_type


def headlines(policies: Sequence[Evaluation]) -> list[Headline]:
    """What the policies kept: never lost (CHORD), and held 5 s longer where there is something to hold."""
    bounds, scores = intervals(policies), mean_scores([e.rows() for e in policies])
    return [
        Headline(
            title,
            f"{100 * scores[name]:.1f} %",
            "95 % interval {:.0f} to {:.0f} %".format(*(100 * b for b in bounds[name])),
        )
        for name, title in (("chord", "never lost (CHORD)"), ("hold", "held 5 s longer"))
        if name in scores
    ]


def overlaps(results: Mapping[int, Results]) -> Table:
    """How deep the hand was in itself and the ground, of all seeds together and the baselines."""
    first = next(iter(results.values()))
    columns = {POLICY: [result.overlaps[POLICY] for result in results.values()]}
    return overlap_table(columns | {title: [first.overlaps[title]] for title in BASELINES})


def pressed(results: Results) -> str:
    """The constants of the constant press, one for each grasp type."""
    return ", ".join(f"{grasp} {constant}" for grasp, constant in results.press.items())


def tracking_plot(results: Mapping[int, Results]) -> Figure:
    """Tracking error over time of the policy, all seeds together, and the baselines."""
    errors = _over_time(results, BASELINES, lambda rollouts: 100 * position_error(rollouts))
    return plots.error_over_time(next(iter(results.values())).env.fps, errors, limit=3.0)


def force_plot(results: Mapping[int, Results]) -> Figure:
    """Grip force over time, over the least that carries the object: the policy, all seeds together, and the press."""
    ratios = _over_time(results, [PRESS], lambda rollouts: grip_force(rollouts) / rollouts.least_force[:, None])
    fps = next(iter(results.values())).env.fps
    return plots.error_over_time(fps, ratios, label="grip force / least", limit=1.0, limit_label="carries")


def _over_time(
    results: Mapping[int, Results], baselines: Iterable[str], value: Callable[[Rollouts], np.ndarray]
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """A value of each frame, and which frames count: of the policy's rollouts with all seeds, and of the baselines'."""
    first = next(iter(results.values()))
    chosen = {POLICY: [result.rollouts[POLICY] for result in results.values()]}
    chosen |= {title: [first.rollouts[title]] for title in baselines}
    return {
        title: (np.concatenate([value(r) for r in each]), np.concatenate([r.counted for r in each]))
        for title, each in chosen.items()
    }


def films(results: Mapping[int, Results], folder: Path) -> dict[str, Film]:
    """Videos `worst.mp4` and `median.mp4` in the folder, of all seeds' rollouts."""
    chosen = median_and_worst({seed: result.evaluations[POLICY] for seed, result in results.items()})
    made = {}
    for name in ("worst", "median"):
        seed, index = chosen[name]
        result = results[seed]
        scores, reason = result.evaluations[POLICY].scores, result.evaluations[POLICY].failure[index]
        caption = (
            f"The {name} rollout: seed {seed}, demonstration {int(result.rollouts[POLICY].demonstration[index])}, "
            f"{reason or 'followed'}, {scores['tracking_error_cm'][index]:.2f} cm and "
            f"{scores['object_rotation_error_deg'][index]:.1f}° off on average."
        )
        made[name] = film(result.env, result.rollouts[POLICY], index, folder / f"{name}.mp4", caption)
    return made


def evaluation_page(
    results: Mapping[int, Results],
    configs: Sequence[Config],
    shown: Mapping[str, Film],
    disturbed: Stress | None = None,
) -> Report:
    """Everything about an evaluation of one or several seeds, under disturbances too where these were rolled out."""
    config, first = configs[0], next(iter(results.values()))
    policies = {seed: result.evaluations[POLICY] for seed, result in results.items()}
    baselines = {title: first.evaluations[title] for title in BASELINES}
    scores, failures, *by_type = tables(results, config)
    objects = [demonstration.object for demonstration in first.env.demonstrations]
    errors = [e.rows()["tracking_error_cm"] for e in policies.values()]
    paper = _published(config)
    failed = failed_table(policies)
    people = person_scores(list(policies.values()), people_of(first.env.demonstrations))
    seeds = ", ".join(str(seed) for seed in policies)
    robot = "" if config.hand == HUMAN else f" hand={config.hand}"
    return Report(
        title=f"{config.name}{robot and f' on {first.env.body.name}'}: evaluation",
        task=(
            f"{len(objects)} {PART_WORDS[config.part]} ({', '.join(dict.fromkeys(_grasps(first)))})"
            f"{'' if config.part == 'train' else ', which training has not seen'}, from the first frame to the last, "
            "unassisted; policies of "
            f"{len(policies)} training seed{'s' if len(policies) > 1 else ''}."
        ),
        headlines=(
            *headlines(list(policies.values())),
            Headline("tracking error", f"{np.mean(errors):.2f} cm", _between(errors, "cm", 2)),
            Headline(
                "constant press",
                f"{100 * baselines[PRESS].rows()['kept']:.1f} %",
                f"never lost and held, nothing learned; zero residual {100 * baselines[ZERO].rows()['kept']:.1f} %, "
                f"demonstration alone {100 * baselines[REPLAY].rows()['kept']:.1f} %",
            ),
            *(
                [Headline("paper", f"{100 * paper.success:.1f} %", f"{paper.tracking_error_cm:.2f} cm")]
                if paper
                else []
            ),
        ),
        sections=(
            Section("Success by every metric", [scores]),
            *([Section("Every grasp type", by_type)] if by_type else []),
            *(
                [
                    Section(
                        "Under disturbances",
                        [
                            Plot(stress_figure(disturbed), "Never lost and still held at the end."),
                            stress_table(disturbed),
                        ],
                    )
                ]
                if disturbed
                else []
            ),
            Section("Demonstration and twin", [shown["worst"], shown["median"]]),
            Section("Tracking error over time", [Plot(tracking_plot(results), TRACKING)]),
            Section("Grip force", [Plot(force_plot(results), FORCE)]),
            Section("The hand in itself and the ground", [overlaps(results)]),
            *([Section("Every person", [people_table(people)])] if people else []),
            Section("How failures failed", [failures]),
            *([Section("Failures", [failed])] if failed.rows else []),
            Section("Every demonstration", [demonstration_table(policies, baselines, objects)]),
        ),
        how=[
            ("engine", first.env.engine.name),
            ("seeds", seeds),
            ("policies", ", ".join(f"{r.checkpoint.steps:,} steps (seed {seed})" for seed, r in results.items())),
            ("machine", f"{processor()}, {len(jax.devices())} {jax.default_backend()} device(s)"),
            ("versions", ", ".join(f"{n} {v}" for n, v in versions("mjx-hand", "mujoco", "jax", "brax").items())),
        ],
        commands=[
            f"python -m train.evaluate config={config.name}{robot} seeds=[{seeds.replace(' ', '')}]"
            + ("" if config.part == Config().part else f" part={config.part}")
            + (" stress=true" if disturbed else "")
        ],
    )


def _published(config: Config) -> Published | None:
    """What the paper reports of this grasp type, of a human hand."""
    return PAPER.get(config.data.grasp) if config.hand == HUMAN else None


def _grasps(result: Results) -> list[str]:
    return groups(result.env.demonstrations)


def _between(values: Sequence[float], unit: str, digits: int) -> str:
    if len(values) == 1:
        return ""
    return f"seeds from {min(values):.{digits}f} to {max(values):.{digits}f} {unit}"

"""A recording is retargeted, a pinch policy is trained, and a report shows what came of it: `make demo`.

    mjx-hand demo [config=pinch_demo] [any override of train.ppo]

With a `config` of its own it makes the same report for any experiment.
"""

import contextlib
import sys
import time
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import jax
import numpy as np
from matplotlib.figure import Figure

from envs.demonstrations.dataset import make_missing_sets
from envs.demonstrations.set_settings import set_folder
from mjx_hand.cli.retarget import retarget
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import load_motion_file
from mjx_hand.progress import clock
from mjx_hand.retarget.sequence import RetargetErrors, retarget_errors, retarget_sequence, rigid_hand_of
from mjx_hand.view.figures import plots
from mjx_hand.view.report import Film, Headline, Plot, Report, Section, Table, print_table, write_report
from train.experiment.evaluate_seeds import POLICY, PRESS, REPLAY, ZERO, Results, evaluate_seeds, median_and_worst
from train.experiment.setup import training_env
from train.experiment.stress import BRIEF, stress
from train.learning.curve import Point
from train.ppo import train
from train.reports.evaluation_page import TRACKING, headlines, tables, tracking_plot
from train.reports.evaluation_record import write_results
from train.reports.machine import processor
from train.reports.published import PAPER
from train.reports.stress_table import stress_table
from train.settings.config import Config, command
from train.view.video import film

_FILM = "Left the demonstration, right the twin: the held-out rollout of median tracking error."
_LEARNING = "Share of training demonstrations tracked from frame 0, unassisted. The level is the untrained policy."
_PROJECTION = "What 20 hinges cannot follow of one recording's 15 rotations, by the exact projection and the paper's."
_TIPS = "Where that puts the finger tips, against the recording's own chain of rotations."


def main(config: Config) -> None:
    """The whole chain, then `report.html` in the experiment's folder."""
    if config.data.folder:
        raise InputError("the demo makes its own demonstrations; leave out data.folder, or train with train.ppo")
    out = Path(config.out)
    timings: list[tuple[str, float]] = []

    with _stage("demonstrations: performed, recorded with markers, fitted, projected", timings):
        make_missing_sets(config.data, config.demonstrations)
        env = training_env(config)
    recording = set_folder(config.data, config.demonstrations) / "heldout" / "000.motion.npz"
    with _stage("retargeting a recording", timings):
        errors = _retarget(recording, out / "retargeted.npz")
    with _stage("training", timings):
        points = train(config, env)
    with _stage("evaluating on held-out demonstrations", timings):
        by_seed = evaluate_seeds([config])
        write_results(by_seed, [config], {})
        results = by_seed[config.seed]
    with _stage("under disturbances", timings):
        disturbed = stress_table(stress([config], BRIEF, press_disturbed=False))
    with _stage("video", timings):
        _, median = median_and_worst({config.seed: results.evaluations[POLICY]})["median"]
        video = film(results.env, results.rollouts[POLICY], median, out / "twin.mp4", _FILM)
    write_report(out / "report.html", _report(config, errors, points, results, disturbed, video, timings))
    for table in [*tables(by_seed, config), disturbed]:
        print_table(table)
    print(f"\nreport: {(out / 'report.html').resolve()}  (open it in a browser)")
    print(f"all results: {out.resolve()}")


@contextlib.contextmanager
def _stage(name: str, timings: list[tuple[str, float]]) -> Iterator[None]:
    """Announce a stage of the run, and note how many seconds it took."""
    print(f"\n== {name}", flush=True)
    began = time.monotonic()
    yield
    timings.append((name, time.monotonic() - began))


def _retarget(recording: Path, out: Path) -> dict[str, RetargetErrors]:
    """Run `mjx-hand retarget`, and collect the errors of the exact projection and the paper's."""
    retarget(recording, out)
    motion = load_motion_file(recording)
    hand = rigid_hand_of(motion, load_hand(side=motion.side))
    return {
        method: retarget_errors(motion, retarget_sequence(motion, hand, method), hand) for method in ("exact", "paper")
    }


def _report(
    config: Config,
    errors: dict[str, RetargetErrors],
    points: list[Point],
    results: Results,
    disturbed: Table,
    video: Film,
    timings: list[tuple[str, float]],
) -> Report:
    rows = {title: evaluation.rows() for title, evaluation in results.evaluations.items()}
    scores, failures, *by_type = tables({config.seed: results}, config)
    paper = PAPER.get(config.data.grasp)
    joints = [name.replace("1", " base").replace("2", " middle").replace("3", " end") for name in LINKS[1:]]
    rotations = {m: np.rad2deg(e.rotation[e.valid]) for m, e in errors.items()}
    exact = errors["exact"]
    tips = {finger: 1e3 * exact.tip_position[exact.valid, k] for k, finger in enumerate(FINGERS)}
    beside = f"paper {paper.tracking_error_cm:.2f} cm" if paper else ""
    return Report(
        title=f"mjx-hand: {config.name}",
        task=(
            "A simulated hand, built from markers recorded on a person, replays that person's "
            f"{config.data.grasp} grasps: reach, grasp, lift, carry, turn and hold an object in physics. "
            "The policy adds small corrections to the recorded motion; replayed alone, the recording drops the object."
        ),
        headlines=(
            *headlines([results.evaluations[POLICY]]),
            Headline(
                "tracking error", f"{rows[POLICY]['tracking_error_cm']:.2f} cm", f"mean over all rollouts; {beside}"
            ),
            Headline(
                "without learning",
                f"{100 * rows[PRESS]['kept']:.0f} %",
                f"never lost and held: constant press; zero residual {100 * rows[ZERO]['kept']:.0f} %, "
                f"demonstration alone {100 * rows[REPLAY]['kept']:.0f} %",
            ),
            Headline("training", clock(points[-1].seconds), f"{points[-1].steps:,} control steps"),
        ),
        sections=(
            Section("Demonstration and twin", [video]),
            Section("Learning", [Plot(_learning_curve(points), _LEARNING)]),
            Section("Tracking error over time", [Plot(tracking_plot({config.seed: results}), TRACKING)]),
            Section("Success by every metric", [scores]),
            *([Section("Every grasp type", by_type)] if by_type else []),
            Section("Under disturbances", [disturbed]),
            Section("How failures failed", [failures]),
            Section("From recorded rotations to hinges", [Plot(plots.joint_errors(joints, rotations), _PROJECTION)]),
            Section(
                "From recording to twin", [Plot(plots.retarget_errors(tips, label="finger-tip error (mm)"), _TIPS)]
            ),
        ),
        how=[
            *((name, clock(seconds)) for name, seconds in timings),
            ("engine", f"{results.env.engine.name}, {config.ppo.num_envs} worlds"),
            ("seed", str(config.seed)),
            ("machine", f"{processor()}, {len(jax.devices())} {jax.default_backend()} device(s)"),
            ("versions", ", ".join(f"{name} {version(name)}" for name in ("mjx-hand", "mujoco", "jax", "brax"))),
        ],
        commands=[f"python -m train.demo config={config.name}", f"python -m train.evaluate config={config.name}"],
    )


def _learning_curve(points: list[Point]) -> Figure:
    return plots.learning_curve(
        np.array([p.steps for p in points]),
        np.array([p.success for p in points]),
        baseline=points[0].success if points[0].steps == 0 else None,
    )


def command_line() -> None:
    """The command, with this process's arguments, and an experiment of its own unless one is given."""
    if not any(argument.startswith("config=") for argument in sys.argv[1:]):
        sys.argv.insert(1, "config=pinch_demo")
    command(main)


if __name__ == "__main__":
    command_line()

"""The ablations: each takes one thing away from an experiment, or puts another in its place."""

import dataclasses

from train.experiment.evaluate_seeds import POLICY, REPLAY, ZERO


@dataclasses.dataclass(frozen=True)
class Variant:
    """One row of the ablations.

    Attributes:
        name: of its folder and row.
        group: what it is about; those of a group share a figure.
        why: what it shows, in a line.
        overrides: of the experiment's configuration.
        column: of an evaluation, which its scores are. Baselines learn nothing: theirs are those of `UNCHANGED`.
    """

    name: str
    group: str
    why: str
    overrides: tuple[str, ...] = ()
    column: str = POLICY

    @property
    def learns(self) -> bool:
        return self.column == POLICY


UNCHANGED = Variant("as configured", "", "What all others are compared with.")

# By importance, a group together: rows appear in this order, as they are done.
VARIANTS = (
    UNCHANGED,
    Variant("residual off", "residual", "The demonstration with its grip: what is there to learn?", column=ZERO),
    Variant("demonstration alone", "residual", "Neither residual nor grip: the recording, replayed.", column=REPLAY),
    Variant("starts at frame 0", "starts", "No reference-state initialisation.", ("task.random_start_prob=0",)),
    Variant(
        "functional axes",
        "hinges",
        "Hinge axes fitted to each recording, in place of the paper's from the rest pose.",
        ("data.capture.axes=functional",),
    ),
    Variant(
        "paper's projection",
        "hinges",
        "Rotations to angles by the formulas as printed, in place of the minimiser.",
        ("data.capture.method=paper",),
    ),
    Variant(
        "tips refined",
        "hinges",
        "Angles moved until finger tips are where the recording has them.",
        ("data.capture.refine=tips",),
    ),
    Variant("no grip", "grip", "The residual alone must press.", ("task.grip_force=0",)),
    Variant("grip of 1 N", "grip", "Lighter than a person's own where pads press.", ("task.grip_force=1",)),
    Variant("grip of 4 N", "grip", "Harder than a person's own where pads press.", ("task.grip_force=4",)),
    Variant("wraps press", "grip", "A hand around an object presses like any other.", ("task.wrap_torque=0",)),
    Variant(
        "no rotation reward",
        "reward",
        "Its term is constant, the position's as before.",
        ("task.reward_rotation_alpha=0.001",),
    ),
    Variant(
        "no position reward",
        "reward",
        "Its term is constant, the rotation's as before.",
        ("task.reward_position_alpha=0.001",),
    ),
    Variant("no cost of actions", "reward", "Large residuals are free.", ("task.rewards.action=0",)),
    Variant(
        "tightening end",
        "episodes",
        "The distance that ends an episode shrinks from 8 to 3 cm.",
        ("task.termination_distance_last=0.03",),
    ),
    Variant(
        "no early end",
        "episodes",
        "A lost object ends no episode.",
        ("task.termination_distance=100", "task.termination_angle=null"),
    ),
    Variant(
        "virtual object controller",
        "episodes",
        "Pulls the object along its reference at first, and fades over half of the training.",
        ("task.assist=300",),
    ),
    Variant("no action filter", "filter", "The residual is what the policy says at once.", ("task.smoothing=0",)),
    Variant(
        "no filter and less noise",
        "filter",
        "The same, exploring with no more noise than the filter lets through.",
        ("task.smoothing=0", "ppo.initial_std=0.09"),
    ),
)

"""The policies of several seeds and the constant press under disturbances that neither is told of.

Each row sets one disturbance to one value (`envs.disturbances.Randomize.only`) for every held-out demonstration, from
frame 0; directions differ from demonstration to demonstration. The last row draws all of them at once.
"""

import dataclasses
from collections.abc import Mapping, Sequence

from envs.disturbances.randomize import Randomize
from envs.evaluation.constant_press import constant_press, search_press
from envs.evaluation.evaluate import Evaluation, evaluate_in
from envs.evaluation.roll_out import make_roll_out, zero_residual
from mjx_hand.progress import counter
from train.experiment.evaluate_seeds import HOLD
from train.experiment.setup import chosen_checkpoint, load_env, training_env
from train.learning.policy import deterministic_policy
from train.settings.config import Config

RECORDED = "as recorded"
HALF = "all at once, drawn at half range"
ROWS: Mapping[str, Randomize] = {
    RECORDED: Randomize.only(),
    "mass × 1.5": Randomize.only(mass=(1.5, 1.5)),
    "mass × 2": Randomize.only(mass=(2.0, 2.0)),
    "friction × 0.7": Randomize.only(friction=(0.7, 0.7)),
    "friction × 0.5": Randomize.only(friction=(0.5, 0.5)),
    "mass × 1.5 and friction × 0.7": Randomize.only(mass=(1.5, 1.5), friction=(0.7, 0.7)),
    "size + 10 %": Randomize.only(size=(1.1, 1.1)),
    "size - 10 %": Randomize.only(size=(0.9, 0.9)),
    "moved 5 mm": Randomize.only(move=(0.005, 0.005)),
    "moved 10 mm": Randomize.only(move=(0.01, 0.01)),
    "moved 20 mm": Randomize.only(move=(0.02, 0.02)),
    "moved 40 mm": Randomize.only(move=(0.04, 0.04)),
    "push 5 N, 0.2 s": Randomize.only(push=(5.0, 5.0)),
    "push 10 N, 0.2 s": Randomize.only(push=(10.0, 10.0)),
    "pose seen 10 mm, 5° off": Randomize.only(seen_move=(0.01, 0.01), seen_turn_deg=(5.0, 5.0)),
    "targets 40 ms late": Randomize.only(delay=(2, 2)),
    HALF: dataclasses.replace(Randomize(share=0.5), variants=1, moved_share=1.0, push_prob=1.0),
}
# The few that tell most.
BRIEF = ("mass × 1.5 and friction × 0.7", "moved 20 mm", HALF)
# For curves: what is varied, and the rows by its value.
CURVES: Mapping[str, Mapping[float, str]] = {
    "moved (mm)": {0.0: RECORDED, 5.0: "moved 5 mm", 10.0: "moved 10 mm", 20.0: "moved 20 mm", 40.0: "moved 40 mm"},
    "mass (factor)": {1.0: RECORDED, 1.5: "mass × 1.5", 2.0: "mass × 2"},
    "friction (factor)": {0.5: "friction × 0.5", 0.7: "friction × 0.7", 1.0: RECORDED},
    "push (N)": {0.0: RECORDED, 5.0: "push 5 N, 0.2 s", 10.0: "push 10 N, 0.2 s"},
}


@dataclasses.dataclass(frozen=True)
class Stress:
    """What rollouts under each row scored.

    Attributes:
        policies: by row, the evaluation of each seed's policy.
        press: by row, that of the constant press.
        strengths: the press's, in words, by grasp type.
        searched: how the training demonstrations were disturbed that it was found on, in words.
        part: of the demonstrations.
    """

    policies: Mapping[str, Mapping[int, Evaluation]]
    press: Mapping[str, Evaluation]
    strengths: Mapping[str, str]
    searched: str
    part: str


def stress(configs: Sequence[Config], rows: Sequence[str] = (), press_disturbed: bool = True) -> Stress:
    """Roll out each seed's policy and the constant press under every row.

    The press is the strongest that searches on the training demonstrations find: as recorded, and disturbed as training
    was. In each row it is the better of the two, which is more than anyone could know beforehand.

    Args:
        configs: an experiment with one seed after the other, which names the part of the demonstrations.
        rows: of `ROWS`; all if none is named.
        press_disturbed: whether the press is searched disturbed as training was, too; it takes a while.

    Raises:
        InputError: a seed without a checkpoint, or with one of another task.
    """
    first, part, rows = configs[0], configs[0].part, rows or tuple(ROWS)
    recorded = load_env(first, part, ROWS[RECORDED])
    checkpoints = {
        config.seed: chosen_checkpoint(config, recorded.observation_size, recorded.action_size) for config in configs
    }
    policy = deterministic_policy(first.ppo, recorded.observation_size, recorded.action_size)
    policies: dict[str, dict[int, Evaluation]] = {}
    presses: dict[str, Evaluation] = {}
    with counter(len(rows) + 1, "under disturbances (rows)") as advance:
        press = constant_press(recorded)
        twice = press_disturbed and first.randomize.share > 0
        searched = [load_env(first, "train"), *([training_env(first)] if twice else [])]
        known = [search_press(env, HOLD) for env in searched]
        pressed = [press.tables(strengths).reference for strengths in known]
        advance(1)
        # Compiled once: the rows' environments differ in their tables alone.
        learned, zero = (make_roll_out(recorded, act, HOLD) for act in (policy, zero_residual))
        for row in rows:
            tables = (recorded if row == RECORDED else load_env(first, part, ROWS[row])).tables
            policies[row] = {
                seed: evaluate_in(recorded, learned(checkpoint.policy, tables))
                for seed, checkpoint in checkpoints.items()
            }
            scored = [
                evaluate_in(recorded, zero(None, dataclasses.replace(tables, reference=reference)))
                for reference in pressed
            ]
            presses[row] = max(scored, key=lambda evaluation: evaluation.scores["kept"].mean())
            advance(1)
    strengths = {
        grasp: " or ".join(dict.fromkeys(press.described(each)[grasp] for each in known)) for grasp in press.full
    }
    how = f"{RECORDED} and disturbed as in training" if twice else RECORDED
    return Stress(policies, presses, strengths, how, part)

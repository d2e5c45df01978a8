"""`load`: an environment ready to step, by the name of a grasp type or from a folder of finished demonstrations."""

from collections.abc import Sequence
from pathlib import Path

from envs.demonstrations.load_set import load_demonstrations
from envs.demonstrations.on_robot.robot_set import robot_demonstrations, robot_set
from envs.demonstrations.set_settings import GIVEN, SetSettings
from envs.demonstrations.twin_hands import twins
from envs.disturbances.randomize import Randomize
from envs.task import Task
from envs.tracking import TrackingEnv
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.bodies.robot_body import robot_body
from mjx_hand.errors import InputError
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.rigid.rigid_hand import RigidHand


def load(
    grasp: str = "",
    part: str = "train",
    engine: str = "auto",
    task: Task | None = None,
    root: str | Path = "outputs/demonstrations",
    folder: str | Path | None = None,
    randomize: Randomize | None = None,
    hand: str = HUMAN,
) -> TrackingEnv:
    """The tracking environment over the demonstrations of a grasp type, or over a folder of finished ones.

        env = envs.load("pinch")
        env = envs.load(folder="my_demonstrations", task=envs.Task(grip_force=2.0))

    Nothing is made: `python -m envs.demonstrations config=pinch` makes a type's default set.

    Args:
        grasp: name of a grasp type, or "all".
        part: "train" or "heldout".
        engine: "auto", "native", "mjx" or "warp".
        task: residuals, rewards, resets; None for the default.
        root: folder below which demonstration sets are kept.
        folder: of `train/NNN.npz` and `heldout/NNN.npz`, or of `NNN.npz` (`mjx_hand.save_demonstration` writes them).
        randomize: what disturbs its episodes, such as `envs.Randomize(share=1.0)`; None for nothing.
        hand: "human", the name of a robot hand, or the path of its description.

    Raises:
        InputError: a type and a folder, or neither; a set that is not made; an empty folder; or as `TrackingEnv`.
    """
    if bool(grasp) == (folder is not None):
        raise InputError(f"grasp is {grasp!r} and folder {folder}; give one of them")
    settings = SetSettings(grasp) if folder is None else SetSettings(GIVEN, folder=str(folder))
    return env_of_set(settings, part, engine, task, root, randomize, hand)


def env_of_set(
    settings: SetSettings,
    part: str,
    engine: str,
    task: Task | None,
    root: str | Path,
    randomize: Randomize | None = None,
    hand: str = HUMAN,
) -> TrackingEnv:
    """The environment over one part of any set, as `load`.

    Raises:
        InputError: as `load`.
    """
    return env_of(load_demonstrations(settings, part, root), engine, task, randomize, hand)


def env_of(
    demonstrations: Sequence[Demonstration],
    engine: str,
    task: Task | None,
    randomize: Randomize | None = None,
    hand: str = HUMAN,
) -> TrackingEnv:
    """The environment over people's demonstrations, for their own hands or brought onto a robot's.

    Raises:
        InputError: as `load`.
    """
    people = twins(demonstrations)
    if hand == HUMAN:
        return TrackingEnv(demonstrations, people, engine, task, randomize=randomize)
    body = robot_body(hand)
    brought = robot_demonstrations(demonstrations, people, body)
    return TrackingEnv(brought, [body] * len(brought), engine, task, randomize=randomize)


def people_of_set(
    settings: SetSettings, part: str, root: str | Path, hand: str
) -> list[tuple[Demonstration, RigidHand]]:
    """What people did, and their hands, in the demonstrations that `env_of_set` is over for a hand, in its order.

    Raises:
        InputError: as `load`.
    """
    demonstrations = load_demonstrations(settings, part, root)
    people = twins(demonstrations)
    if hand == HUMAN:
        return list(zip(demonstrations, people, strict=True))
    done = robot_set(demonstrations, people, robot_body(hand)).done
    return [(demonstrations[k], people[k]) for k in done]

"""Play a policy in the browser, in real time: `mjx-hand play config=pinch`.

Shows a held-out demonstration as a person did it, the twin under the policy, a person's hand or a robot's
(`hand=allegro`), the object, and the error. `play.demonstration=3` chooses one; without it, the one of median tracking
error. What has not been trained here is played by the bundled policy, on the demonstration bundled with it, where there
is one. `play.unstable=FILE` shows a simulation that diverged in training instead: the state before the step, and each
physics step of it that the engine could make.
"""

from envs.demonstrations.load_env import people_of_set
from envs.grip_table import people_of
from envs.tracking import TrackingEnv
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.errors import InputError
from mjx_hand.motion import Demonstration
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.view.browser.viewer import Viewer
from train.experiment.bundled_policies import bundled_env, bundled_people, with_policy
from train.experiment.evaluate_seeds import median_and_worst
from train.experiment.setup import chosen_path, load_env, rolled_out, settled
from train.learning.checkpoint import load_checkpoint
from train.learning.unstable import load_unstable
from train.settings.config import Config, command
from train.view.play_scene import rollout_scene
from train.view.unstable_scene import unstable_scene


def viewer(config: Config) -> Viewer:
    """The rollout, or the simulation that diverged, in a viewer, paused at its first frame.

    Raises:
        InputError: what `rollout_viewer`, `unstable_viewer` and `Viewer` refuse.
    """
    return unstable_viewer(config) if config.play.unstable else rollout_viewer(config)


def unstable_viewer(config: Config) -> Viewer:
    """The file `play.unstable` in a viewer.

    Raises:
        InputError: no such file, or one of other demonstrations.
    """
    unstable = load_unstable(config.play.unstable)
    env = load_env(config, "train")
    return Viewer(unstable_scene(unstable, env, config.name), config.play.port)


def rollout_viewer(config: Config) -> Viewer:
    """A rollout of the policy in a viewer.

    Raises:
        InputError: no such demonstration, or what `chosen_checkpoint` and `Viewer` refuse.
    """
    config, included = with_policy(config)
    load_checkpoint(chosen_path(config))  # before anything is made for it
    beside = included and config.play.demonstration is None
    env = bundled_env(config) if beside else load_env(config, "heldout")
    _, rollouts, scores = rolled_out(config, env)
    errors = scores.scores["tracking_error_cm"]
    index = config.play.demonstration
    if index is None:
        _, index = median_and_worst({config.seed: scores})["median"]
    if index >= len(errors):
        raise InputError(f"play.demonstration is {index}; there are {len(errors)}, numbered from 0")
    outcome = scores.failure[index] or "followed to the end"
    robot = "" if env.body.name == HUMAN else f" on {env.body.name}"
    title = f"{config.name} {index}{robot}: {outcome}, {errors[index]:.2f} cm"
    recorded, person = _people(config, env, beside)[index]
    return Viewer(rollout_scene(env, rollouts, index, recorded, person, title), config.play.port)


def _people(config: Config, env: TrackingEnv, beside: bool) -> list[tuple[Demonstration, RigidHand]]:
    """What people did in the demonstrations of the environment, and their hands."""
    people = people_of(env.hands)
    if people is not None:
        return list(zip(env.demonstrations, people, strict=True))
    if beside:
        return bundled_people(config)
    return people_of_set(config.data, "heldout", config.demonstrations, config.hand)


def main(config: Config) -> None:
    """Serve until Ctrl-C."""
    shown = viewer(config)
    shown.play()
    print(f"{shown.scene.title}: open {shown.url} in a browser; Ctrl-C here ends it", flush=True)
    shown.wait()


def command_line() -> None:
    """The command, with this process's arguments."""
    command(main, settled)


if __name__ == "__main__":
    command_line()

"""A simulation that diverged as a scene for the browser viewer: each physics step, and what was commanded."""

import numpy as np

from envs.scene import NUM_WRIST, demonstration_spec
from envs.tracking import TrackingEnv
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.errors import InputError
from mjx_hand.view.browser.hand_scene import object_layers
from mjx_hand.view.browser.model_layer import model_layer
from mjx_hand.view.browser.scene import Curve, Scene
from train.learning.unstable import Unstable, step_again
from train.view.play_scene import ghost


def unstable_scene(unstable: Unstable, env: TrackingEnv, name: str) -> Scene:
    """The state before the step, then one frame a physics step, with the commanded pose as a grey ghost.

    Targets that are no numbers are drawn where the hand was.

    Args:
        unstable: the step.
        env: over the demonstrations that the training had.
        name: of the experiment.

    Raises:
        InputError: they are not those that the simulation followed.
    """
    engine, k = env.engine, unstable.demonstration
    if not 0 <= k < len(env.demonstrations) or len(unstable.qpos) != engine.models[0].nq:
        raise InputError(
            f"play.unstable follows demonstration {k} in {len(unstable.qpos)} coordinates; {name!r} has "
            f"{len(env.demonstrations)} of {engine.models[0].nq}: give the config and data it was trained with"
        )
    demonstration, edges = env.demonstrations[k], env.body.rigid is None
    first = env.body.num_coordinates  # of the object's coordinates
    fps = float(1 / engine.models[k].opt.timestep)
    path = step_again(engine.models[k], unstable, engine.substeps)
    told = np.where(np.isfinite(unstable.targets), unstable.targets, env.body.of_targets(unstable.qpos))
    seen = demonstration_spec(demonstration, env.hands[k], visual=True).compile()
    commanded = np.concatenate([hand_coordinates(seen, told), path[0, first:]])
    layers = (
        model_layer(seen, path, "twin", edges=edges),
        *object_layers(demonstration, path[:, first:]),
        ghost(model_layer(seen, np.repeat(commanded[None], len(path), axis=0), "commanded", edges=edges)),
    )
    away = path - path[0]
    turned = np.rad2deg(np.abs(away[:, NUM_WRIST:first]).max(axis=1))
    curves = (
        Curve("object, moved", 100 * np.linalg.norm(away[:, first : first + 3], axis=1), "cm"),
        Curve("hinge that turned most", turned, "degrees"),
    )
    title = (
        f"{name} seed {unstable.seed}, world {unstable.world} at {unstable.steps:,} steps: demonstration {k}, frame "
        f"{unstable.frame}; {len(path) - 1} of {engine.substeps} physics steps"
    )
    if lost := np.flatnonzero(~np.isfinite(unstable.targets)).tolist():
        title += f"; targets {lost} are no numbers"
    return Scene(title=title, fps=fps, layers=layers, curves=curves, ground=0.0)

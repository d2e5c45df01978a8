"""The constant press: a baseline that learns nothing and presses harder, with one strength for each grasp type.

Pads press with the reference's own grip (`envs.grip`) at a constant force. Wraps add the torques that close the hand
(`GraspType.closing`, which no policy is told), from before the object moves until the end. Where no type says how to
press and the reference closes hands that wrap (`Task.wrap_torque`), its grip is made stronger. The strength of each
type is the best of a grid on the training demonstrations.
"""

import dataclasses
from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.evaluation.evaluate import evaluate_in
from envs.evaluation.roll_out import make_roll_out, zero_residual
from envs.grasps import grasp_names, grasp_type
from envs.grasps.grasp_type import Pads, Wrap, closing_torque
from envs.grip_force import closing_ramp
from envs.grip_table import grip_forces, grip_table
from envs.scene import NUM_WRIST
from envs.tracking import TrackingEnv
from envs.twin import Tables
from mjx_hand.bodies.closing import closing_directions
from mjx_hand.files.array_cache import cached, model_bytes
from mjx_hand.motion.demonstration import Demonstration

# What is tried, as shares of full strength: the force or torques that a type's demonstrations are made with.
SHARES = (0.25, 0.375, 0.5, 2 / 3, 0.75, 1.0, 1.25, 1.5, 2.0)
_UNKNOWN_FULL = 4.0  # full strength where no type says it, as a multiple of the reference's force
_RAMP = 0.6  # s before the object first moves, in which a wrap closes
_JUDGED_BY = ("chord", "hold", "manip_trans_object")


@dataclasses.dataclass(frozen=True)
class ConstantPress:
    """How the demonstrations of an environment can be pressed.

    Attributes:
        env: the environment.
        full: force (N) at full strength by type that presses with pads, None of those that wrap, and of none where the
            reference closes hands that wrap.
        contact: hinge offsets (rad) that put pads on the surface.
        press: hinge offsets (rad) of full strength, before the controllers' limits.
    """

    env: TrackingEnv
    full: Mapping[str, float | None]
    contact: Float[Array, "d t u"]
    press: Float[Array, "d t u"]

    def tables(self, strengths: Mapping[str, float]) -> Tables:
        """The environment's tables with controls that press with these shares of full strength, by type.

        Full strength where a type has none, as where no training demonstration is of it.
        """
        env, gains = self.env, self.env.gains
        limit = np.concatenate([np.zeros(NUM_WRIST), gains.force_limit / gains.stiffness])
        share = np.array([strengths.get(d.grasp, 1.0) for d in env.demonstrations])[:, None, None]
        grip = self.contact + jnp.clip(share * self.press, -limit, limit)
        reference = env.reference
        controls = reference.controls - reference.grip + grip
        changed = dataclasses.replace(reference, controls=controls, grip=grip)
        return dataclasses.replace(env.tables, reference=changed)

    def described(self, strengths: Mapping[str, float]) -> dict[str, str]:
        """Each type's constant in words."""
        words = {}
        for grasp, full in self.full.items():
            share = strengths.get(grasp, 1.0)
            if full is not None:
                words[grasp] = f"{share * full:.3g} N"
            elif grasp in grasp_names():
                words[grasp] = f"{share:.3g} × its closing torques"
            else:
                words[grasp] = f"{share * _UNKNOWN_FULL:.3g} × the reference's grip"
        return words


def constant_press(env: TrackingEnv) -> ConstantPress:
    """What presses the demonstrations of an environment."""
    forces = grip_forces(env.demonstrations, env.hands, env.task.grip_force)
    grasps = np.array([d.grasp for d in env.demonstrations])
    full = {d.grasp: _full(d, env, float(np.median(forces[grasps == d.grasp]))) for d in env.demonstrations}
    pressing = np.array([np.nan if (force := full[d.grasp]) is None else force for d in env.demonstrations])
    # The grip is an offset to the surface and torques in proportion to the force, which 1 N leaves within all limits.
    given = env.demonstrations, env.hands, env.reference.targets
    contact, one = (grip_table(*given, np.where(pressing >= 0, force, np.nan), env.gains) for force in (0.0, 1.0))
    press = np.array((one - contact) * np.nan_to_num(pressing)[:, None, None])
    for k, d in enumerate(env.demonstrations):
        if full[d.grasp] is None and d.grasp not in grasp_names():
            press[k] = _UNKNOWN_FULL * np.asarray(env.reference.grip[k])
        elif full[d.grasp] is None:
            ramp = closing_ramp(d, press.shape[1], _RAMP)
            press[k, :, NUM_WRIST:] = ramp[:, None] * _closing_torque(d, env) / env.gains.stiffness
    return ConstantPress(env, full, contact, jnp.asarray(press, jnp.float32))


def search_press(env: TrackingEnv, hold: float) -> dict[str, float]:
    """The share of full strength that is best for each type, of `SHARES`.

    Judged by the mean of CHORD, hold and ManipTrans' object criterion over the environment's demonstrations,
    disturbed as its episodes are.

    Args:
        env: of training demonstrations.
        hold: how long they are held on (s).
    """

    def compute() -> dict[str, np.ndarray]:
        press, roll_out = constant_press(env), make_roll_out(env, zero_residual, hold)
        scores = []
        for share in SHARES:
            rollouts = roll_out(None, press.tables(dict.fromkeys(press.full, share)))
            found = evaluate_in(env, rollouts).scores
            scores.append(np.mean([found[name] for name in _JUDGED_BY if name in found], axis=0))
        return {"scores": np.array(scores)}

    models = [model_bytes(model) for model in env.models]
    told = (env.reference, env.task.substeps, env.engine.name, hold, SHARES)
    disturbed = [] if env.randomize is None else [dataclasses.astuple(env.randomize)]
    scores = cached(compute, "press", *models, *told, *disturbed)["scores"]
    grasps = np.array([d.grasp for d in env.demonstrations])
    return {
        str(grasp): SHARES[int(scores[:, grasps == grasp].mean(axis=1).argmax())] for grasp in dict.fromkeys(grasps)
    }


def _closing_torque(demonstration: Demonstration, env: TrackingEnv) -> Float[np.ndarray, "j"]:
    """The torques (N m) of a wrap at full strength: of a human hand its type's, of another what its joints have."""
    closing = grasp_type(demonstration.grasp).closing
    assert isinstance(closing, Wrap)
    if env.body.rigid is not None:
        return closing_torque(closing)
    return closing_directions(env.body) * env.gains.force_limit


def _full(demonstration: Demonstration, env: TrackingEnv, force: float) -> float | None:
    """Newtons of full strength, or None where the type wraps or there is none and the reference closes what wraps.

    `force` is the reference's own.
    """
    if demonstration.grasp in grasp_names():
        closing = grasp_type(demonstration.grasp).closing
        return closing.force if isinstance(closing, Pads) else None
    return None if env.task.wrap_torque else _UNKNOWN_FULL * force

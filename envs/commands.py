"""What a hand is commanded: its reference's controls, moved to where the object stands, or where a person has it.

`followed_target` moves the wrist's path with an object that stands elsewhere. The others are of a hand that a person
teleoperates as it happens (`Task.live`): the wrist is commanded where it is tracked, the joints where they are tracked,
steadied while the hand holds, and the policy's residual is added.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from envs.reference import Reference
from envs.scene import NUM_WRIST
from envs.twin import Twin
from mjx_hand.player.approach import followed
from mjx_hand.player.features import reciprocal
from mjx_hand.player.steadying import holding, steadied

EXPERT = "expert_action"  # of a state's info: what a policy may imitate


def next_command(reference: Reference, twin: Twin, frame: Int[Array, ""], seconds: float) -> Float[Array, "u"]:
    """What the hand is told on the way to a frame (m, rad), without the residual.

    Args:
        reference: of the hands.
        twin: at the frame before.
        frame: to which it goes.
        seconds: a control step.
    """
    before, now = reference.controls[twin.demonstration, twin.frame], reference.controls[twin.demonstration, frame]
    if twin.commanded is None:
        return now
    holds = holding(twin.physics.contact[:, :3], jnp)
    joints = slice(NUM_WRIST, None)
    steady = steadied(twin.commanded[joints], before[joints], now[joints], holds, seconds, jnp)
    return now.at[joints].set(steady)


def first_residual_and_command(
    reference: Reference, demonstration: Int[Array, ""], frame: Int[Array, ""], scale: Float[np.ndarray, "u"]
) -> tuple[Float[Array, "u"], Float[Array, "u"] | None]:
    """The residual that an episode starts with (m, rad), and what a teleoperated hand was told last."""
    if reference.lacking is None:
        return jnp.zeros(reference.controls.shape[-1]), None
    # What nothing but a residual presses would fall before one has grown.
    pressing = jnp.clip(reference.lacking[demonstration, frame], -scale, scale) * (frame > 0)
    return pressing, reference.controls[demonstration, frame]


def expert_action(
    reference: Reference,
    demonstration: Int[Array, ""],
    frame: Int[Array, ""],
    commanded: Float[Array, "u"] | None,
    scale: Float[np.ndarray, "u"],
) -> dict[str, Float[Array, "u"]]:
    """The action of a teleoperated hand's policy whose residual, where it is kept up, makes up for all that is lacking.

    It belongs to the step into this frame, as the reward does. Its share of the wrist is nothing.
    """
    if reference.lacking is None or commanded is None:
        return {}
    wanted = reference.controls[demonstration, frame] + reference.lacking[demonstration, frame]
    return {EXPERT: jnp.clip((wanted - commanded) * reciprocal(scale), -1.0, 1.0)}


def followed_target(
    reference: Reference,
    demonstration: Int[Array, ""],
    frame: Int[Array, ""],
    displacement: Float[Array, "3"],
) -> Float[Array, "u"]:
    """What is added to the demonstrated targets (m, rad) at a frame (`mjx_hand.player.approach`).

    Args:
        reference: the demonstrations.
        demonstration, frame: of them.
        displacement: of the object at first: x, y (m) and the turn about the vertical (rad).
    """
    return followed(
        reference.targets[demonstration, frame],
        reference.base[demonstration],
        reference.object_pose[demonstration, 0, :3],
        displacement * reference.approach[demonstration, frame],
        jnp,
    )

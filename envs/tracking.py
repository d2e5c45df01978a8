"""`TrackingEnv`: a twin of the hand replays demonstrations, with a residual that mends what replaying alone loses.

target(t) = demonstration(t) + grip(t) + residual(t), the first led by the controllers' own lag;
residual <- tau residual + (1 - tau) scale action (arXiv 2512.07359, section IV).
"""

import copy
import dataclasses
from collections.abc import Sequence
from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np
from brax.envs.base import Env, State
from jaxtyping import Array, Float, Int

from envs.observation import observe, residual_scale
from envs.physics import make_engine
from envs.physics.engine import PhysicsState
from envs.reference import Reference, make_reference
from envs.replay import assisted_replay
from envs.rewards import TrackedStep, metric_names, weighted_terms
from envs.scene import NUM_WRIST, OBJECT, demonstration_models
from envs.task import Task
from mjx_hand.errors import InputError
from mjx_hand.files.array_cache import cached, model_bytes
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.pytree import pytree
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand, without_meshes
from mjx_hand.rotations import quaternion_difference

_TAIL = 10  # no episode starts in a demonstration's last frames, where nothing is left to learn


@pytree
class Twin:
    """A world's state: physics, which demonstration it follows, how far it is, and the residual so far."""

    physics: PhysicsState
    demonstration: Int[Array, "*b"]
    frame: Int[Array, "*b"]
    residual: Float[Array, "*b 26"]


@pytree
class Tables:
    """What an environment looks up: arrays that a compiled function can be given as an argument.

    What was compiled over `env.with_tables(argument)` runs any other set of equally many, equally long demonstrations.

    Attributes:
        reference: the demonstrations and their controls.
        starts: the engine's state at every frame of every demonstration.
        inertia: mass (kg) and mean moment of inertia (kg m2) of each demonstration's object.
        low, high: limits of the targets (m, rad).
        engine: the engine's own (`Engine.tables`).
    """

    reference: Reference
    starts: PhysicsState
    inertia: Float[Array, "d 2"]
    low: Float[Array, "26"]
    high: Float[Array, "26"]
    engine: Any


def twin_of(state: State) -> Twin:
    """What a state of `TrackingEnv` carries; Brax's own type for it is that of its physics."""
    return cast(Twin, state.pipeline_state)


class TrackingEnv(Env):
    """One world; `jax.vmap` it for many. Brax's `State` carries a `Twin` as its pipeline state.

    Actions are 26 numbers in [-1, 1], residuals of the wrist's 3 slides and 3 turns and of the 20 hinges.

    Args:
        demonstrations: what to track; the i-th runs on the i-th hand.
        hands: the twin's hand for each demonstration, built from the person's fitted shape.
        engine: "auto", "native", "mjx" or "warp".
        task: rewards, residual ranges, resets.
        gains: of the hand's position controllers.

    Attributes:
        demonstrations, hands: what it was built over.
        gains: of the hand's position controllers.
        models: MuJoCo's of each demonstration's scene.
        tables: what it looks up; `with_tables` puts another set's in their place.

    Raises:
        InputError: demonstrations that do not fit together, a rate the task cannot keep, or an unknown engine.
    """

    def __init__(
        self,
        demonstrations: Sequence[Demonstration],
        hands: Sequence[RigidHand],
        engine: str = "auto",
        task: Task | None = None,
        gains: Gains | None = None,
    ):
        self.demonstrations, self.hands = tuple(demonstrations), tuple(hands)
        self.task = Task() if task is None else task
        self.gains = gains = Gains() if gains is None else gains
        reference = _cached_reference(demonstrations, hands, self.task.grip_force, gains)
        self.assisted = self.task.assist > 0
        self.models = demonstration_models(demonstrations, hands, gains=gains, assisted=self.assisted)
        self.engine = make_engine(engine, self.models, self.task.substeps)
        self.dt = float(self.models[0].opt.timestep * self.task.substeps)
        self.fps = demonstrations[0].motion.fps
        if abs(self.fps * self.dt - 1) > 1e-3:
            raise InputError(
                f"demonstrations at {self.fps:g} frames/s do not fit control steps of {self.dt * 1000:g} ms; "
                f"resample them to {1 / self.dt:g} frames/s"
            )
        low, high = self.models[0].actuator_ctrlrange[: self.action_size].T
        self.tables = Tables(
            reference=reference,
            starts=self._start_table(reference),
            inertia=jnp.array([[m.body(OBJECT).mass[0], m.body(OBJECT).inertia.mean()] for m in self.models]),
            low=jnp.asarray(low, jnp.float32),
            high=jnp.asarray(high, jnp.float32),
            engine=self.engine.tables,
        )

    def with_tables(self, tables: Tables) -> "TrackingEnv":
        """The same environment over another set's tables, which may be arguments of a function that is compiled."""
        other = copy.copy(self)
        other.tables = tables
        other.engine = self.engine.with_tables(tables.engine)
        return other

    @property
    def reference(self) -> Reference:
        """What the twins are told to follow, and where the objects are to be."""
        return self.tables.reference

    @property
    def num_demonstrations(self) -> int:
        """How many demonstrations there are to track."""
        return len(self.models)

    @property
    def num_frames(self) -> int:
        """Of the longest demonstration."""
        return self.reference.targets.shape[1]

    @property
    def action_size(self) -> int:
        """How many numbers an action has: the residuals of six wrist joints and 20 hinges."""
        return NUM_WRIST + NUM_HINGES

    @property
    def observation_size(self) -> int:
        """How many numbers an observation has."""
        return jax.eval_shape(self.reset, jax.random.key(0)).obs.shape[-1]

    @property
    def backend(self) -> str:
        """The physics engine's name."""
        return self.engine.name

    def reset(self, rng: Array) -> State:
        """A training episode: a random demonstration, in its middle with probability `task.random_start_prob`."""
        which, whether, where = jax.random.split(rng, 3)
        demonstration = jax.random.randint(which, (), 0, self.num_demonstrations)
        last = jnp.maximum(self.reference.length[demonstration] - _TAIL, 1)
        frame = jax.random.randint(where, (), 0, last)
        frame = jnp.where(jax.random.bernoulli(whether, self.task.random_start_prob), frame, 0)
        return self.start(demonstration, frame)

    def start(self, demonstration: Int[Array, ""], frame: Int[Array, ""]) -> State:
        """The state at a frame of a demonstration; frame 0 is the unassisted start that evaluations use."""
        physics = jax.tree.map(lambda table: table[demonstration, frame], self.tables.starts)
        twin = Twin(
            physics=physics,
            demonstration=jnp.asarray(demonstration, jnp.int32),
            frame=jnp.asarray(frame, jnp.int32),
            residual=jnp.zeros(self.action_size),
        )
        zero = jnp.zeros(())
        names = (*metric_names(self.task.rewards), "error/position", "error/rotation", "unstable")
        metrics = dict.fromkeys(names, zero)
        info = {"truncation": zero, "progress": jnp.ones(())}
        return State(twin, self._observe(twin), zero, zero, metrics, info)  # type: ignore[call-arg]

    def step(self, state: State, action: Float[Array, "26"]) -> State:
        """One control step towards the next frame of the demonstration; past its end the last frame is held.

        `state.info["progress"]` is the share of the training that is over; 1, without help for the object, unless the
        learner says otherwise.
        """
        twin = twin_of(state)
        task, progress = self.task, state.info["progress"]
        action = jnp.clip(action, -1.0, 1.0)
        frame, residual, targets = self.command(twin, action)
        if self.assisted:
            targets = jnp.concatenate([targets, self._assistance(twin, frame, progress)])
        physics = self.engine.step(twin.physics, targets)
        before = twin.residual
        twin = Twin(physics=physics, demonstration=twin.demonstration, frame=frame, residual=residual)

        position, rotation = self._errors(twin)
        terms = weighted_terms(task.rewards, self._tracked(twin, position, rotation, action, residual - before))
        done = jnp.maximum((position > task.lost_distance(progress)).astype(jnp.float32), physics.unstable)
        finished = (frame >= self.reference.length[twin.demonstration] - 1).astype(jnp.float32)
        metrics = {**terms, "error/position": position, "error/rotation": rotation, "unstable": physics.unstable}
        info = {**state.info, "truncation": finished * (1 - done)}
        return state.replace(  # type: ignore[attr-defined]
            pipeline_state=twin,
            obs=self._observe(twin),
            reward=sum(terms.values()),
            done=jnp.maximum(done, finished),
            metrics=metrics,
            info=info,
        )

    def command(
        self, twin: Twin, action: Float[Array, "26"]
    ) -> tuple[Int[Array, ""], Float[Array, "26"], Float[Array, "26"]]:
        """The next frame, the residual there, and what the actuators are told on the way (m, rad)."""
        task = self.task
        residual = task.smoothing * twin.residual + (1 - task.smoothing) * residual_scale(task) * action
        frame = jnp.minimum(twin.frame + 1, self.reference.length[twin.demonstration] - 1)
        target = self.reference.controls[twin.demonstration, frame] + residual
        return frame, residual, jnp.clip(target, self.tables.low, self.tables.high)

    def _assistance(self, twin: Twin, frame: Int[Array, ""], progress: Float[Array, ""]) -> Float[Array, "6"]:
        """The virtual object controller's force (N, world) and torque (N m, the object's axes)."""
        stiffness = self.task.assist_stiffness(progress)
        damping = 2 * jnp.sqrt(stiffness)
        mass, inertia = self.tables.inertia[twin.demonstration]
        poses = self.reference.object_pose[twin.demonstration]
        now, wanted = poses[twin.frame], poses[frame]
        object_pose, speed = twin.physics.qpos[self.action_size :], twin.physics.qvel[self.action_size :]
        moving = (wanted[:3] - now[:3]) * self.fps
        turn = quaternion_difference(object_pose[3:], wanted[3:])
        turning = quaternion_difference(now[3:], wanted[3:]) * self.fps
        force = stiffness * (wanted[:3] - object_pose[:3]) + damping * (moving - speed[:3])
        torque = stiffness * turn + damping * (turning - speed[3:])
        return jnp.concatenate([mass * force, inertia * torque])

    def _observe(self, twin: Twin) -> Float[Array, "o"]:
        return observe(self.reference, self.task, twin.demonstration, twin.frame, twin.physics, twin.residual)

    def _tracked(self, twin: Twin, position: Array, rotation: Array, action: Array, moved: Array) -> TrackedStep:
        """What the reward is counted from; `moved` is how far the residual went in this step."""
        place = twin.demonstration, twin.frame
        return TrackedStep(
            position=position,
            rotation=rotation,
            position_alpha=self.task.reward_position_alpha,
            rotation_alpha=self.task.reward_rotation_alpha,
            hinges=twin.physics.qpos[NUM_WRIST : self.action_size],
            hinges_reference=self.reference.targets[place][NUM_WRIST:],
            tips=twin.physics.sensordata.reshape(5, 3),
            tips_reference=self.reference.tips[place],
            action=action,
            change=moved / residual_scale(self.task),
        )

    def _errors(self, twin: Twin) -> tuple[Array, Array]:
        """The object's distance (m) and angle (rad) from where the demonstration has it."""
        pose = self.reference.object_pose[twin.demonstration, twin.frame]
        object_pose = twin.physics.qpos[NUM_WRIST + NUM_HINGES :]
        turn = quaternion_difference(pose[3:], object_pose[3:])
        return jnp.linalg.norm(object_pose[:3] - pose[:3]), jnp.sqrt(jnp.sum(turn**2) + 1e-12)

    def _start_table(self, reference: Reference) -> PhysicsState:
        """The engine's state at every frame of every demonstration, so that a reset is a look-up."""

        def compute() -> dict[str, np.ndarray]:
            states = assisted_replay(self.models, reference, self.task.substeps)
            return {name: np.asarray(a, np.float32) for name, a in zip(("qpos", "qvel", "ctrl"), states, strict=True)}

        replayed = cached(compute, *(model_bytes(m) for m in self.models), reference, self.task.substeps)
        qpos, qvel, ctrl = (replayed[name] for name in ("qpos", "qvel", "ctrl"))
        count, frames = qpos.shape[:2]
        variant = np.repeat(np.arange(count, dtype=np.int32), frames)
        ctrl = np.pad(ctrl, ((0, 0), (0, 0), (0, self.models[0].nu - self.action_size)))  # the object's motors rest
        rows = (variant, *(a.reshape(count * frames, -1) for a in (qpos, qvel, ctrl)))
        table = jax.jit(lambda r: jax.lax.map(lambda row: self.engine.reset(*row), r, batch_size=1024))(rows)
        return jax.tree.map(lambda leaf: leaf.reshape(count, frames, *leaf.shape[1:]), table)


def _cached_reference(
    demonstrations: Sequence[Demonstration], hands: Sequence[RigidHand], grip_force: float | None, gains: Gains
) -> Reference:
    def compute() -> dict[str, np.ndarray]:
        made = make_reference(demonstrations, hands, grip_force=grip_force, gains=gains)
        return {field.name: np.asarray(getattr(made, field.name)) for field in dataclasses.fields(made)}

    bare = [without_meshes(hand) for hand in hands]
    arrays = cached(compute, list(demonstrations), bare, grip_force, dataclasses.astuple(gains))
    return Reference(**{name: jnp.asarray(array) for name, array in arrays.items()})

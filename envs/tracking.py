"""`TrackingEnv`: a twin of the hand replays demonstrations, with a residual that mends what replaying alone loses.

target(t) = demonstration(t) + grip(t) + residual(t), the first led by the controllers' own lag;
residual <- tau residual + (1 - tau) scale action (arXiv 2512.07359, section IV).
"""

import copy
import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from brax.envs.base import Env, State
from jaxtyping import Array, Float, Int

from envs.assistance import assistance
from envs.commands import expert_action, first_residual_and_command, followed_target, next_command
from envs.disturbances.episode import delayed, pushing, seen_pose
from envs.disturbances.randomize import Randomize
from envs.disturbances.tables import disturbance_tables, disturbed_start
from envs.disturbances.variation import draw_variations
from envs.grip_force import least_contact_force
from envs.observation import observe, residual_scale
from envs.physics import make_engine
from envs.physics.engine import PhysicsState
from envs.reference import Reference, cached_reference
from envs.replay import cached_replay
from envs.rewards import TrackedStep, metric_names, weighted_terms
from envs.scene import NUM_WRIST, OBJECT, demonstration_models
from envs.task import Task, check_rate
from envs.twin import Tables, Twin, twin_of
from envs.varied_scene import varied_models
from mjx_hand.bodies.body import Body
from mjx_hand.bodies.human_body import check_one_kind
from mjx_hand.motion.demonstration import Demonstration
from mjx_hand.player.features import reciprocal
from mjx_hand.rigid.gains import Gains
from mjx_hand.rigid.rigid_hand import RigidHand
from mjx_hand.rotations import quaternion_difference

_VARIATION_SEED = 20  # of what is drawn when an environment is made
_TAIL = 10  # no episode starts in a demonstration's last frames, where nothing is left to learn


class TrackingEnv(Env):
    """One world; `jax.vmap` it for many. Brax's `State` carries a `Twin` as its pipeline state.

    Actions are numbers in [-1, 1], residuals of the wrist's 3 slides and 3 turns and of the hand's actuated joints.

    Args:
        demonstrations: what to track; the i-th runs on the i-th hand.
        hands: the twin's hand for each demonstration: built from the person's fitted shape, or a robot's `Body`.
        engine: "auto", "native", "mjx" or "warp".
        task: rewards, residual ranges, resets.
        gains: of the hand's position controllers; the hand's own if None.
        randomize: what disturbs its episodes; None for nothing.

    Attributes:
        demonstrations, hands: what it was built over.
        body: of what kind the hands are; the first one's.
        gains: of the hand's position controllers.
        models: MuJoCo's of each demonstration's scene, undisturbed.
        variations: how the engine's scenes differ from these, for each demonstration; one, in nothing, undisturbed.
        tables: what it looks up; `with_tables` puts another set's in their place.

    Raises:
        InputError: demonstrations that do not fit together, a rate the task cannot keep, or an unknown engine.
    """

    def __init__(
        self,
        demonstrations: Sequence[Demonstration],
        hands: Sequence[RigidHand | Body],
        engine: str = "auto",
        task: Task | None = None,
        gains: Gains | None = None,
        randomize: Randomize | None = None,
    ):
        self.demonstrations, self.hands = tuple(demonstrations), tuple(hands)
        self.task = task = Task() if task is None else task
        self.body = check_one_kind(hands)
        self._scale = residual_scale(task, self.body.names, self.body.reach)
        self.gains = gains = self.body.gains if gains is None else gains
        reference = cached_reference(demonstrations, hands, task.grip_force, task.wrap_torque, gains, task.live)
        self.assisted, self.randomize = task.assist > 0, randomize
        motors, contacts = self.assisted or randomize is not None, task.contacts
        self.models = demonstration_models(demonstrations, hands, gains=gains, assisted=motors, contacts=contacts)
        self.variations = draw_variations(randomize or Randomize.only(), len(self.demonstrations), _VARIATION_SEED)
        scenes = self.models
        if randomize is not None:
            scenes = varied_models(self.demonstrations, self.hands, self.variations, gains, contacts)
        self.engine = make_engine(engine, scenes, self.task.substeps)
        self.dt = float(self.models[0].opt.timestep * self.task.substeps)
        self.fps = demonstrations[0].motion.fps
        check_rate(self.fps, self.dt)
        limits = jnp.asarray(self.models[0].actuator_ctrlrange[: self.action_size], jnp.float32)
        starts = self._start_table(reference)
        self.tables = Tables(
            reference=reference,
            starts=starts,
            least_force=jnp.array([least_contact_force(model) for model in self.engine.models], jnp.float32),
            inertia=jnp.array([[m.body(OBJECT).mass[0], m.body(OBJECT).inertia.mean()] for m in self.models]),
            low=limits[:, 0],
            high=limits[:, 1],
            engine=self.engine.tables,
            disturbances=randomize
            and disturbance_tables(
                randomize, self.demonstrations, self.variations, np.asarray(reference.controls), starts, self._states
            ),
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
        """How many numbers an action has: the residuals of six wrist joints and of the hand's."""
        return self.body.num_targets

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
        frame = jax.random.randint(where, (), 0, jnp.maximum(self.reference.length[demonstration] - _TAIL, 1))
        frame = jnp.where(jax.random.bernoulli(whether, self.task.random_start_prob), frame, 0)
        return self.start(demonstration, frame, jax.random.fold_in(rng, 0))

    def start(self, demonstration: Int[Array, ""], frame: Int[Array, ""], rng: Array | None = None) -> State:
        """The state at a frame of a demonstration; frame 0 is the unassisted start that evaluations use.

        Disturbances are drawn with `rng`; without one they are the same for a demonstration whenever it starts. Where
        they put the object elsewhere it starts at frame 0, whatever frame is asked for.
        """
        demonstration, frame = jnp.asarray(demonstration, jnp.int32), jnp.asarray(frame, jnp.int32)
        physics, episode = jax.tree.map(lambda table: table[demonstration, frame], self.tables.starts), None
        if (tables := self.tables.disturbances) is not None:
            key = jax.random.fold_in(jax.random.key(0), demonstration) if rng is None else rng
            told = tables, self.reference.controls, self.reference.object_pose, self.task.follow_object
            frame, physics, episode = disturbed_start(*told, demonstration, frame, physics, key)
        residual, commanded = first_residual_and_command(self.reference, demonstration, frame, self._scale)
        twin = Twin(
            physics=physics,
            demonstration=demonstration,
            frame=frame,
            residual=residual,
            episode=episode,
            commanded=commanded,
        )
        zero, expert = jnp.zeros(()), expert_action(self.reference, demonstration, frame, commanded, self._scale)
        names = (*metric_names(self.task.rewards), "error/position", "error/rotation", "unstable")
        metrics = dict.fromkeys(names, zero)
        info = {"truncation": zero, "progress": jnp.ones(()), **expert}
        return State(twin, self._observe(twin), zero, zero, metrics, info)  # type: ignore[call-arg]

    def step(self, state: State, action: Float[Array, "u"]) -> State:
        """One control step towards the next frame of the demonstration; past its end the last frame is held.

        `state.info["progress"]` is the share of the training that is over; 1, without help for the object, unless the
        learner says otherwise.
        """
        twin = twin_of(state)
        task, progress = self.task, state.info["progress"]
        action = jnp.clip(action, -1.0, 1.0)
        frame, residual, targets, commanded = self.command(twin, action)
        episode, tables, force = twin.episode, self.tables.disturbances, None
        if self.assisted:
            force = self._assistance(twin, frame, progress)
        if episode is not None and tables is not None:
            episode, targets = delayed(episode, targets)
            push = pushing(episode, tables.episode, frame)
            force = push if force is None else force + push
        physics = self.engine.step(twin.physics, targets if force is None else jnp.concatenate([targets, force]))
        before = twin.residual
        twin = dataclasses.replace(
            twin, physics=physics, frame=frame, residual=residual, episode=episode, commanded=commanded
        )

        position, rotation = self._errors(twin)
        terms = weighted_terms(task.rewards, self._tracked(twin, position, rotation, action, residual - before))
        done = jnp.maximum(task.lost(position, rotation, progress).astype(jnp.float32), physics.unstable)
        finished = (frame >= self.reference.length[twin.demonstration] - 1).astype(jnp.float32)
        metrics = {**terms, "error/position": position, "error/rotation": rotation, "unstable": physics.unstable}
        expert = expert_action(self.reference, twin.demonstration, frame, commanded, self._scale)
        info = {**state.info, "truncation": finished * (1 - done), **expert}
        return state.replace(  # type: ignore[attr-defined]
            pipeline_state=twin,
            obs=self._observe(twin),
            reward=sum(terms.values()),
            done=jnp.maximum(done, finished),
            metrics=metrics,
            info=info,
        )

    def command(
        self, twin: Twin, action: Float[Array, "u"]
    ) -> tuple[Int[Array, ""], Float[Array, "u"], Float[Array, "u"], Float[Array, "u"] | None]:
        """The next frame, the residual there, what the actuators are told on the way (m, rad), and, of a teleoperated
        hand alone, the same without the residual."""
        task = self.task
        residual = task.smoothing * twin.residual + (1 - task.smoothing) * self._scale * action
        frame = jnp.minimum(twin.frame + 1, self.reference.length[twin.demonstration] - 1)
        commanded = next_command(self.reference, twin, frame, self.dt)
        target = commanded + residual
        if twin.episode is not None:
            target = target + followed_target(self.reference, twin.demonstration, frame, twin.episode.displacement)
        targets = jnp.clip(target, self.tables.low, self.tables.high)
        return frame, residual, targets, None if twin.commanded is None else commanded

    def _assistance(self, twin: Twin, frame: Int[Array, ""], progress: Float[Array, ""]) -> Float[Array, "6"]:
        """The virtual object controller's force (N, world) and torque (N m, the object's axes)."""
        poses, first = self.reference.object_pose[twin.demonstration], self.body.num_coordinates
        return assistance(
            twin.physics.qpos[first:],
            twin.physics.qvel[first:],
            poses[twin.frame],
            poses[frame],
            self.fps,
            self.tables.inertia[twin.demonstration],
            self.task.assist_stiffness(progress),
        )

    def _observe(self, twin: Twin) -> Float[Array, "o"]:
        physics, tables = twin.physics, self.tables.disturbances
        if twin.episode is not None and tables is not None:
            n = self.body.num_coordinates
            seen = seen_pose(twin.episode, tables.episode, twin.frame, physics.qpos[n:])
            physics = dataclasses.replace(physics, qpos=jnp.concatenate([physics.qpos[:n], seen]))
        told = self.reference, self.task, self.body, twin.demonstration, twin.frame, physics, twin.residual
        return observe(*told, twin.episode and twin.episode.displacement, twin.commanded)

    def _tracked(self, twin: Twin, position: Array, rotation: Array, action: Array, moved: Array) -> TrackedStep:
        """What the reward is counted from; `moved` is how far the residual went in this step."""
        place = twin.demonstration, twin.frame
        return TrackedStep(
            position=position,
            rotation=rotation,
            position_alpha=self.task.reward_position_alpha,
            rotation_alpha=self.task.reward_rotation_alpha,
            hinges=self.body.of_targets(twin.physics.qpos)[NUM_WRIST:],
            hinges_reference=self.reference.targets[place][NUM_WRIST:],
            tips=twin.physics.sensordata.reshape(-1, 3),
            tips_reference=self.reference.tips[place],
            action=action,
            change=moved * reciprocal(self._scale),
            forces=twin.physics.contact[:, :3],
            least_force=self.tables.least_force[twin.physics.variant],
        )

    def _errors(self, twin: Twin) -> tuple[Array, Array]:
        """The object's distance (m) and angle (rad) from where the demonstration has it."""
        pose = self.reference.object_pose[twin.demonstration, twin.frame]
        object_pose = twin.physics.qpos[self.body.num_coordinates :]
        turn = quaternion_difference(pose[3:], object_pose[3:])
        return jnp.linalg.norm(object_pose[:3] - pose[:3]), jnp.sqrt(jnp.sum(turn**2) + 1e-12)

    def _start_table(self, reference: Reference) -> PhysicsState:
        """The engine's state at every frame of every demonstration, so that a reset is a look-up."""
        qpos, qvel, ctrl = cached_replay(self.models, reference, self.task.substeps)
        count, frames = qpos.shape[:2]
        # Any of a demonstration's scenes will do: what a state holds does not depend on what is varied.
        variant = np.repeat(np.arange(count, dtype=np.int32) * len(self.variations[0]), frames)
        table = self._states(variant, *(a.reshape(count * frames, -1) for a in (qpos, qvel, ctrl)))
        return jax.tree.map(lambda leaf: leaf.reshape(count, frames, *leaf.shape[1:]), table)

    def _states(self, variant: np.ndarray, qpos: np.ndarray, qvel: np.ndarray, controls: np.ndarray) -> PhysicsState:
        """The engine's states for rows of variant, qpos, qvel and the targets' controls."""
        ctrl = np.pad(controls, ((0, 0), (0, self.models[0].nu - self.action_size)))  # the object's motors rest
        rows = (variant, qpos, qvel, ctrl)
        return jax.jit(lambda r: jax.lax.map(lambda row: self.engine.reset(*row), r, batch_size=1024))(rows)

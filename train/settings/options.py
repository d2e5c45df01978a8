"""What an experiment can be told besides its data and task: learning, checks, processes, debugging, playing."""

import dataclasses
import math

from mjx_hand.errors import InputError

FORMS = ("onnx", "npz", "c")  # of an exported policy


@dataclasses.dataclass(frozen=True)
class Ppo:
    """Proximal policy optimisation (Schulman et al. 2017), as `brax.training.agents.ppo` has it.

    Attributes:
        num_updates: the budget, whatever the number of worlds: an update is `num_envs * unroll_length` control steps.
        num_timesteps: the budget in control steps of all worlds together, in place of num_updates where given.
        num_envs: worlds in parallel; a multiple of num_minibatches.
        unroll_length: steps of each world between updates.
        num_minibatches, num_updates_per_batch: gradient steps an update are their product.
        learning_rate, entropy_cost, discounting, gae_lambda, clipping_epsilon, max_grad_norm: as usual.
        imitation: weight of the policy's squared distance from an expert's actions in the states that the policy gets
            to (as in DAgger, Ross et al. 2011, https://arxiv.org/abs/1011.0686), which there are for teleoperated hands
            (`task.live`); it fades to nothing, linearly, over the share `imitation_until` of the training.
        policy_layers, value_layers: hidden layer sizes.
        initial_std: standard deviation of actions at first; a residual of 1 is the task's full range.
    """

    num_updates: int = 400
    num_timesteps: int | None = None
    num_envs: int = 256
    unroll_length: int = 16
    num_minibatches: int = 8
    num_updates_per_batch: int = 4
    learning_rate: float = 3e-4
    entropy_cost: float = 3e-4
    discounting: float = 0.97
    gae_lambda: float = 0.95
    clipping_epsilon: float = 0.2
    max_grad_norm: float = 1.0
    imitation: float = 0.0
    imitation_until: float = 0.5
    policy_layers: tuple[int, ...] = (128, 128)
    value_layers: tuple[int, ...] = (256, 256)
    initial_std: float = 0.25

    def __post_init__(self):
        for name in ("policy_layers", "value_layers"):
            if any(size < 1 for size in getattr(self, name)):
                raise InputError(f"ppo.{name} is {list(getattr(self, name))}; every layer needs at least 1 unit")
        whole = ("num_updates", "num_timesteps", "num_envs", "unroll_length", "num_minibatches")
        for name in (
            *whole,
            "num_updates_per_batch",
            "learning_rate",
            "clipping_epsilon",
            "max_grad_norm",
            "imitation_until",
            "initial_std",
        ):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InputError(f"ppo.{name} is {value}; it must be a number above 0")
        for name in ("entropy_cost", "imitation"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError(f"ppo.{name} is {getattr(self, name)}; it must be a number that is not negative")
        for name in ("discounting", "gae_lambda"):
            if not 0 < getattr(self, name) <= 1:
                raise InputError(f"ppo.{name} is {getattr(self, name)}; it must be above 0 and at most 1")
        if self.num_envs % self.num_minibatches:
            raise InputError(
                f"ppo.num_envs is {self.num_envs}, not a multiple of ppo.num_minibatches ({self.num_minibatches}); "
                f"give for example {max(self.num_envs // self.num_minibatches, 1) * self.num_minibatches}"
            )

    @property
    def steps_per_update(self) -> int:
        """Control steps of all worlds together between two updates of the networks."""
        return self.num_envs * self.unroll_length

    @property
    def timesteps(self) -> int:
        """Control steps of all worlds together after which the training is over; its last update may go beyond."""
        return self.num_updates * self.steps_per_update if self.num_timesteps is None else self.num_timesteps

    @property
    def budget(self) -> int:
        """Updates until the training is over."""
        return -(-self.timesteps // self.steps_per_update)


@dataclasses.dataclass(frozen=True)
class Checks:
    """Evaluation while training, on the training demonstrations from frame 0, unassisted.

    Attributes:
        every: control steps between evaluations; the best policy so far is kept. null: as often as fits into a tenth
            of the training's time (`train.learning.cadence`).
        stop_at: stop once this share succeeds (ManipTrans object); above 1, never.
    """

    every: int | None = None
    stop_at: float = 2.0

    def __post_init__(self):
        if self.every is not None and self.every < 1:
            raise InputError(f"checks.every is {self.every}; it must be at least 1 step, or null")
        if math.isnan(self.stop_at):
            raise InputError("checks.stop_at is nan; give a share such as 0.97, or 2 to never stop early")


@dataclasses.dataclass(frozen=True)
class Distributed:
    """Several processes, each with its own devices, as one training (`jax.distributed`).

    Attributes:
        processes: how many.
        process: which of them this one is, from 0.
        coordinator: host and port of process 0 ("node1:1234"), which the others can reach.
        timeout: seconds to wait for the others.
    """

    processes: int = 1
    process: int = 0
    coordinator: str = ""
    timeout: int = 300

    def __post_init__(self):
        if self.processes < 1:
            raise InputError(f"distributed.processes is {self.processes}; it must be at least 1")
        if not 0 <= self.process < self.processes:
            raise InputError(
                f"distributed.process is {self.process}; {self.processes} processes are numbered 0 to "
                f"{self.processes - 1}"
            )
        if self.timeout < 1:
            raise InputError(f"distributed.timeout is {self.timeout}; it must be at least 1 second")
        if self.processes > 1 and not self.coordinator.rpartition(":")[2].isdigit():
            raise InputError(
                f"distributed.coordinator is {self.coordinator!r}; give host and port of process 0, such as node1:1234"
            )


@dataclasses.dataclass(frozen=True)
class Debug:
    """Help with what goes wrong.

    Attributes:
        nan_guard: keep the state before each world's last unstable step, and write it to `out/unstable` for replay.
    """

    nan_guard: bool = False


@dataclasses.dataclass(frozen=True)
class Play:
    """What `train.play` shows.

    Attributes:
        demonstration: number of a held-out demonstration; null for the one of median tracking error.
        unstable: file of a simulation that diverged (`debug.nan_guard`), to show instead of a policy.
        port: to serve the viewer at; 0 chooses a free one.
    """

    demonstration: int | None = None
    unstable: str = ""
    port: int = 8080

    def __post_init__(self):
        if self.demonstration is not None and self.demonstration < 0:
            raise InputError(f"play.demonstration is {self.demonstration}; demonstrations are numbered from 0")
        if not 0 <= self.port <= 65535:
            raise InputError(f"play.port is {self.port}; valid: 0 to 65535")


@dataclasses.dataclass(frozen=True)
class Export:
    """What `train.export` writes.

    Attributes:
        to: forms of the policy: onnx, npz, c. On that command's line `to=onnx` alone is enough.
        folder: to write to; empty for `export` in `out`.
        demonstrations: how many held-out demonstrations to write for players, the first ones; null for three, and for
            a policy that comes with the project for the one that is beside it.
    """

    to: tuple[str, ...] = ("npz",)
    folder: str = ""
    demonstrations: int | None = None

    def __post_init__(self):
        unknown = [form for form in self.to if form not in FORMS]
        if unknown or not self.to:
            raise InputError(f"to is {','.join(unknown) or 'empty'}; valid: {', '.join(FORMS)}, or several: to=onnx,c")
        if self.demonstrations is not None and self.demonstrations < 0:
            raise InputError(f"export.demonstrations is {self.demonstrations}; give 0 for none, or how many")

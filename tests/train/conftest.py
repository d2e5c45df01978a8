"""One tiny set of real demonstrations and one tiny training, made once a session: compiling them is what costs."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

import train.ppo
from envs.demonstrations.dataset import make_set
from envs.demonstrations.set_settings import SetSettings
from envs.disturbances import Randomize
from envs.evaluation.roll_out import make_roll_out
from envs.parallel import ParallelEnv
from envs.task import Task
from envs.tracking import TrackingEnv
from tests.robots.urdfs import urdf_of
from tests.train.robot_run import robot_run
from train.experiment.setup import load_env
from train.learning.curve import Point
from train.learning.learner import Learner
from train.settings.config import Config
from train.settings.options import Checks, Ppo

TINY = Ppo(
    num_timesteps=64,
    num_envs=4,
    unroll_length=8,
    num_minibatches=2,
    num_updates_per_batch=2,
    policy_layers=(16,),
    value_layers=(16,),
)


@pytest.fixture(scope="session")
def tiny(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Config:
    """An experiment on one demonstration of each part. Several workers share one set."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if hasattr(request.config, "workerinput") else base
    config = Config(
        name="tiny",
        engine="native",
        out=str(tmp_path_factory.mktemp("tiny") / "out"),
        demonstrations=str(shared / "demonstrations"),
        data=SetSettings(grasp="pinch", people=1, heldout_people=1, trials=1, heldout_trials=1),
        task=Task(wrap_torque=0.0),  # as config=pinch has it, which commands name
        randomize=Randomize(),
        ppo=TINY,
        checks=Checks(every=32),
    )
    with FileLock(shared / "demonstrations.lock"):
        make_set(config.data, config.demonstrations)
    return config


@pytest.fixture(scope="session", autouse=True)
def compiled_once() -> Iterator[None]:
    """Trainings of one world share what is traced and loaded, which takes seconds each time."""
    learners: dict[Any, Learner] = {}
    rollers: dict[Any, Any] = {}

    def learner(parallel: ParallelEnv, ppo: Ppo) -> Learner:
        key = (id(parallel.env), parallel.guard, dataclasses.replace(ppo, num_timesteps=1))
        if key not in learners:
            learners[key] = Learner(parallel, ppo)  # which keeps the environment alive, and its id its own
        return learners[key]

    def roll_out(env: TrackingEnv, policy: Any, repeats: int) -> Any:
        assert repeats == 1, "on a CPU"
        if id(env) not in rollers:
            rollers[id(env)] = make_roll_out(env, policy)
        return rollers[id(env)]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(train.ppo, "Learner", learner)
        patched.setattr(train.ppo, "make_roll_out", roll_out)
        yield


@pytest.fixture(scope="session")
def env(tiny: Config) -> TrackingEnv:
    return load_env(tiny, "train")


@pytest.fixture(scope="session")
def trained(tiny: Config, env: TrackingEnv) -> tuple[Path, list[Point]]:
    """The folder of a finished training, and what it returned."""
    return Path(tiny.out), train.ppo.train(tiny, env)


@pytest.fixture(scope="session")
def allegro(tmp_path_factory: pytest.TempPathFactory) -> Config:
    """A run of an Allegro hand, whose policy holds the pinch that comes with the project."""
    assert urdf_of("allegro").is_file()  # skips without the package that carries it
    return robot_run(tmp_path_factory.mktemp("allegro"), "allegro")

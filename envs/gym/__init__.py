"""Gymnasium environments, one for each grasp type.

    env = gymnasium.make_vec("envs.gym:mjx-hand/pinch-v0", num_envs=64)

What `make_vector_env` takes can be given there too.
"""

from pathlib import Path

from envs.demonstrations.dataset import make_missing_sets
from envs.demonstrations.load_env import env_of_set
from envs.demonstrations.set_settings import SetSettings
from envs.grasps import grasp_names
from envs.task import Task
from mjx_hand.errors import InputError

try:
    import gymnasium
except ImportError:
    raise InputError("Gymnasium is not installed; install it: pip install 'mjx-hand[gym]'") from None

from gymnasium.vector import AutoresetMode

from envs.gym.vector_env import TrackingVectorEnv

__all__ = ["TrackingVectorEnv", "make_vector_env"]


def make_vector_env(
    data: SetSettings | str,
    num_envs: int = 64,
    part: str = "train",
    demonstrations: str | Path = "outputs/demonstrations",
    engine: str = "auto",
    task: Task | None = None,
    seed: int = 0,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
) -> TrackingVectorEnv:
    """The environment over a set of demonstrations, which are made below `demonstrations` where missing.

    Args:
        data: what the set holds, or the name of a grasp type, for the set that `config=NAME` trains on.
        num_envs, seed, autoreset_mode: as `TrackingVectorEnv` has them.
        part: "train" or "heldout".
        demonstrations: the folder below which demonstration sets are kept.
        engine, task: as `TrackingEnv` has them.

    Raises:
        InputError: what cannot be used, by name.
    """
    settings = SetSettings(data) if isinstance(data, str) else data
    make_missing_sets(settings, demonstrations)
    env = env_of_set(settings, part, engine, task, demonstrations)
    return TrackingVectorEnv(env, num_envs, seed, autoreset_mode)


for _name in grasp_names():
    gymnasium.register(f"mjx-hand/{_name}-v0", vector_entry_point="envs.gym:make_vector_env", kwargs={"data": _name})

"""What teleoperated hands (`Task.live`) ask of an experiment."""

from envs.demonstrations.set_settings import SetSettings
from envs.task import Task
from mjx_hand.bodies.human_body import HUMAN
from mjx_hand.errors import InputError
from train.settings.options import Ppo


def check_teleoperation(task: Task, ppo: Ppo, data: SetSettings, hand: str) -> None:
    """Raise InputError for imitation without teleoperation, and for teleoperation of what no tracker saw."""
    if ppo.imitation and not task.live:
        raise InputError(
            f"ppo.imitation is {ppo.imitation}, and task.live false; there is an action to imitate of teleoperated "
            "hands alone, the reference of others is commanded anyway: leave it out"
        )
    if task.live and hand != HUMAN:
        raise InputError(f"task.live is true and hand {hand!r}; a person's hand alone is teleoperated yet")
    if task.live and not (data.streamed or data.folder):
        raise InputError(
            "task.live is true and data.streamed false; give data.streamed=true, as config=live has it, or a "
            "data.folder whose demonstrations have a tracked hand"
        )

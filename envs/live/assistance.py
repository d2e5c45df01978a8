"""What helps a live hand to hold things, by name."""

from pathlib import Path

from envs.live.twin.policy_assist import check_live
from envs.live.twin.world import GRIP, OFF, Assist
from mjx_hand.errors import InputError
from mjx_hand.player.exported_policy import load_exported_policy

POLICY = "policy"
ASSISTS = (OFF, GRIP, POLICY)
FILE = Path(__file__).with_name("assist_policy.npz")  # the project's own, of `config=live`


def assistance(name: str, side: str, policy: Path | None = None) -> Assist:
    """What a live world is helped with.

    Args:
        name: one of `ASSISTS`.
        side: of the hand.
        policy: a file of `train.export`, in place of the project's own.

    Raises:
        InputError: another name, a policy for what needs none, or one that cannot help a live hand.
    """
    if name != POLICY and policy is not None:
        raise InputError(f"{policy}: a policy helps with --assist policy, not with --assist {name}")
    if name == OFF:
        return OFF
    if name == GRIP:
        return GRIP
    if name == POLICY:
        file = FILE if policy is None else policy
        return check_live(load_exported_policy(file), str(file), side)
    raise InputError(f"assist is {name!r}; valid: {', '.join(ASSISTS)}")

"""How hard a hand must press to carry an object that no grasp type says anything about."""

RECORDED = "recorded"  # what a demonstration that is of no grasp type calls its grasp
_GRAVITY = 9.81


def grip_force_of(mass: float, friction: float, share: float = 1.0) -> float:
    """The force (N) of a thumb against the fingers with which friction carries `2 share` times the object's weight.

    Both sides of a grip bear: 2 F μ = m g would just hold.
    """
    return share * mass * _GRAVITY / friction

import numpy as np
from scipy.spatial.transform import Rotation

from envs.demonstrations.scripted.perform import OUTCOMES, _outcomes

LIFTED = 50


def take(shift=0.0, turn=0.0, rise=0.1):
    """Wrist and object rise together; after the lift the object moves and turns in the hand by so much."""
    t = np.linspace(0, 1, 101)
    height = np.clip(2 * t, 0, 1) * rise
    wrist = np.stack([0 * t, 0 * t, height + 0.1], axis=1)
    spin = Rotation.from_rotvec(np.outer(t, [0.0, 0.0, 2.0]))  # the whole hand turns, which is no slip
    late = np.clip(2 * t - 1, 0, 1)
    inside = spin.apply(np.stack([0.05 + late * shift, 0 * t, 0 * t - 0.1], axis=1))
    turned = spin * Rotation.from_rotvec(np.outer(late, [turn, 0.0, 0.0]))
    return spin.as_matrix(), wrist, np.concatenate([wrist + inside, turned.as_quat(scalar_first=True)], axis=1)


def test_each_way_to_fail_is_told_by_its_name():
    takes = [take(), take(), take(rise=0.03), take(shift=0.02), take(turn=0.4), take(shift=0.008, turn=0.2)]
    rotation, position, pose = (np.stack(parts) for parts in zip(*takes, strict=True))
    diverged = np.array([False, True, False, False, False, False])
    lifted = np.full(len(takes), LIFTED)
    found = [OUTCOMES[k] for k in _outcomes(rotation, position, pose, lifted, diverged)]
    assert found == ["held", "diverged", "not lifted", "slipped", "turned in the hand", "held"]

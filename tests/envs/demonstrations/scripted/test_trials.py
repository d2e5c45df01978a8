"""Every grasp type is performed in the engine, holds its object, and is the grasp that its name says."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations.scripted.trials import perform_trials, support_boxes
from envs.grasps import grasp_names, grasp_type
from envs.scene import OBJECT, scene_spec, wrist_coordinates
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import RigidHand

# Fingers that must touch, and those that must not: what tells the types apart.
TOUCHING = {
    "pinch": ({"thumb", "index", "middle"}, {"ring", "pinky", "wrist"}),
    "lateral": ({"thumb", "index"}, {"middle", "ring", "pinky", "wrist"}),
    "power": ({"thumb", "index", "middle", "ring"}, set()),
    "cylindrical": ({"thumb", "index", "middle", "ring"}, set()),
    "spherical": ({"thumb", "index", "middle"}, set()),
}


@pytest.fixture(scope="module")
def hand() -> RigidHand:
    model = load_hand()
    return build_rigid_hand(model, np.zeros(model.num_shape))


def fingers_at(model: mujoco.MjModel, qpos: np.ndarray) -> set[str]:
    """The fingers (or "wrist", the palm) that MuJoCo has in contact with the object."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    bodies = {model.body(model.geom_bodyid[g]).name for contact in data.contact for g in contact.geom}
    return {name.rstrip("123") for name in bodies - {OBJECT, "world"}}


# One type whose pads press and one that wraps; the others take as long each.
QUICK = ("pinch", "cylindrical")


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in grasp_names()]
)
def test_a_type_is_performed_and_is_what_it_is_called(name, hand):
    grasp = grasp_type(name)
    trials, tally = perform_trials(grasp, [hand], per_person=2, seed=1)
    assert len(trials) == tally["held"] == 2
    assert sum(tally.values()) % 3 == 0  # batches of three attempts
    for trial in trials:
        rise = trial.object_pose[:, 2] - trial.object_pose[0, 2]
        assert rise.max() > 0.10
        assert abs(rise[25]) < 0.003  # it stood still before it was touched
        quaternions = Rotation.from_matrix(trial.wrist_rotation).as_quat(scalar_first=True)
        base = trial.wrist_rotation[0]
        model = scene_spec(hand, trial.object, *support_boxes(grasp), base).compile()
        wrist = wrist_coordinates(trial.wrist_position, quaternions, base)
        touching = fingers_at(model, np.concatenate([wrist[-1], trial.angles[-1], trial.object_pose[-1]]))
        must, must_not = TOUCHING.get(name, (set(), set()))
        assert must <= touching
        assert not must_not & touching


def test_a_type_that_cannot_hold_says_what_happened(hand, monkeypatch):
    monkeypatch.setattr("envs.demonstrations.scripted.trials._ROUNDS", 1)
    monkeypatch.setattr("envs.demonstrations.scripted.trials.squeeze_angles", lambda *args: np.zeros(20))
    with pytest.raises(InputError, match=r"'pinch': hands \[0\] held fewer than 2 objects in 3 attempts \(.*3\)"):
        perform_trials(grasp_type("pinch"), [hand], per_person=2, seed=1)

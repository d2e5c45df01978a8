"""A person's pinch on an Allegro hand, 1.6 times as large and with four fingers: contacts coincide."""

import dataclasses
import itertools

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations.load_env import env_of_set
from envs.demonstrations.on_robot import bring
from envs.demonstrations.on_robot.bring import on_robot, possible_grasps
from envs.demonstrations.on_robot.follow import APPROACH
from envs.demonstrations.on_robot.grasp import still_targets
from envs.demonstrations.on_robot.least_squares import solve
from envs.demonstrations.on_robot.left_out import NO_CLOSURE, NO_FINGERS, OUT_OF_REACH, LeftOut
from envs.demonstrations.on_robot.pads import demonstrated_pads
from envs.demonstrations.on_robot.robot_scene import RobotScene
from envs.demonstrations.on_robot.trial import Rehearsal
from envs.demonstrations.set_settings import SetSettings
from envs.grip_force import closing_ramp
from envs.grip_table import grip_table
from envs.model_grip import NEAR, Press, Touch
from envs.reference import demonstrated_targets
from envs.scene import OBJECT, demonstration_spec
from mjx_hand.bodies.coordinates import hand_coordinates
from mjx_hand.errors import InputError
from mjx_hand.pytree import replace

FINGERS = ("thumb", "index", "middle")


def test_least_squares_stay_within_limits():
    """The nearest point of a box to a point outside is known."""
    wanted = np.array([2.0, 0.3])
    found, cost = solve(lambda x: (x - wanted, np.eye(2)), np.zeros(2), np.full(2, -1.0), np.ones(2), 50)
    np.testing.assert_allclose(found, [1.0, 0.3], atol=1e-6)
    assert cost == pytest.approx(0.5)


def test_the_pads_are_those_of_the_pinch(demonstrations, hands):
    """Thumb, index and middle finger; at the grasp on the cube's faces, which they move with from then on."""
    d = demonstrations[1]
    pads = demonstrated_pads(d, hands[1])
    assert pads.fingers == FINGERS
    centre = d.object_pose[pads.grasp, :3]
    reach = np.linalg.norm(pads.places[pads.grasp] - centre, axis=1)
    assert (reach > 0.7 * d.object.size[0]).all()
    assert (reach < 1.8 * d.object.size[0]).all()
    towards = (centre - pads.places[pads.grasp]) / reach[:, None]
    assert (np.sum(towards * pads.inward, axis=1) > 0.5).all()


def test_fingers_touch_where_the_persons_do(brought, demonstrations, hands, allegro):
    """By MuJoCo's distances in the robot's own scene: on the surface at the grasp and while the object is carried,
    where the person's recorded fingers come off and sink in by millimetres."""
    assert brought.fingers == FINGERS
    assert brought.grasp.off.max() < 0.012
    assert brought.grasp.depth < 0.002
    d = brought.demonstration
    model = demonstration_spec(d, allegro).compile()
    data, targets = mujoco.MjData(model), demonstrated_targets(d)
    thing = [g for g in range(model.ngeom) if model.geom_bodyid[g] == model.body(OBJECT).id]
    lifted = np.flatnonzero(d.object_pose[:, 2] - d.object_pose[0, 2] > 0.03)
    grasp = demonstrated_pads(demonstrations[1], hands[1]).grasp
    for frame in [grasp, *lifted[:: max(len(lifted) // 5, 1)]]:
        data.qpos[:] = np.concatenate([targets[frame], d.object_pose[frame]])
        mujoco.mj_kinematics(model, data)
        for finger in FINGERS:
            geoms = [model.geom(c.name).id for c in allegro.contacts if c.finger == finger]
            gap = min(mujoco.mj_geomDistance(model, data, a, b, 0.1, None) for a in geoms for b in thing)
            assert -0.002 < gap < 0.001, (frame, finger)
    np.testing.assert_array_equal(d.object_pose, demonstrations[1].object_pose)


def test_nothing_comes_near_the_object_before_it_is_touched(brought, demonstrations, hands, allegro):
    """By MuJoCo's distances: 0.1 s before the person's first touch every link still keeps off the object, farther than
    where the grip would close, and in no frame is any link more than 2 mm inside. A robot's fingers are thicker than
    its pads' way allows for: brought onto the Allegro without that, bottles were knocked over before they were held."""
    d = brought.demonstration
    first = int(np.argmax(demonstrated_pads(demonstrations[1], hands[1]).touching.any(axis=1)))
    model = demonstration_spec(d, allegro).compile()
    data, targets = mujoco.MjData(model), demonstrated_targets(d)
    thing = [g for g in range(model.ngeom) if model.geom_bodyid[g] == model.body(OBJECT).id]
    links = [model.geom(c.name).id for c in allegro.contacts]
    least = []
    for frame in range(0, d.num_frames, 3):
        data.qpos[:] = np.concatenate([targets[frame], d.object_pose[frame]])
        mujoco.mj_kinematics(model, data)
        least.append(min(mujoco.mj_geomDistance(model, data, a, b, 0.1, None) for a in links for b in thing))
    before = (first - round(0.1 * d.motion.fps)) // 3
    assert before > 3
    assert min(least[:before]) > NEAR
    assert min(least) > -0.002


def test_pads_come_straight_to_their_faces(brought, demonstrations, hands, allegro):
    """While nothing touches the hand stays at its distance in front of each face, and its foremost points with it: a
    thumb that came the nearest way, from above, was caught on the cube's upper edge."""
    d = brought.demonstration
    pads = demonstrated_pads(demonstrations[1], hands[1])
    first = int(np.argmax(pads.touching.any(axis=1)))
    frame = first - 1  # nobody has closed yet
    model = demonstration_spec(d, allegro).compile()
    touch = Touch(model, allegro)
    touch.place(hand_coordinates(model, demonstrated_targets(d)[frame]), d.object_pose[frame])
    turn = [Rotation.from_quat(d.object_pose[k, 3:], scalar_first=True) for k in (pads.grasp, frame)]
    for k, finger in enumerate(pads.fingers):
        moved = turn[1] * turn[0].inv()
        inward = moved.apply(pads.inward[k])
        place = d.object_pose[frame, :3] + moved.apply(pads.surface[k] - d.object_pose[pads.grasp, :3])
        link = max(number for number, name in enumerate(touch.fingers) if name == finger)
        assert (place - touch.foremost(link, inward)) @ inward > 0.8 * APPROACH, finger


def test_the_grip_sets_in_shortly_before_the_object_moves(brought, allegro):
    """Before that fingers may touch, and do not press: J^T f of a tip that is still off takes it aside as well."""
    d = brought.demonstration
    moves = int(np.argmax(closing_ramp(d, d.num_frames, 1e-3) > 0))
    for seconds, share in ((0.4, 0.0), (0.3, 0.0), (0.16, 7 / 15), (0.0, 1.0)):
        frame = moves - round(seconds * d.motion.fps)
        found = np.asarray(grip_table([d], [allegro], targets_of(d), np.array([12.0]), allegro.gains))[0, frame]
        np.testing.assert_allclose(found[6:], share * touching_grip(d, allegro, frame), atol=1e-6)
    assert np.abs(touching_grip(d, allegro, moves)).max() > 0.01


def test_what_is_in_the_air_from_the_beginning_is_pressed_from_then_on(brought, allegro):
    """As where a recording begins with the object in the hand, which keeps still at first."""
    d = brought.demonstration
    high = int(np.argmax(d.object_pose[:, 2] > d.object_pose[0, 2] + 0.05))
    still = np.r_[[high] * 50, high : d.num_frames]
    motion = replace(
        d.motion,
        angles=d.motion.angles[still],
        wrist_position=d.motion.wrist_position[still],
        wrist_quaternion=d.motion.wrist_quaternion[still],
        valid=d.motion.valid[still],
    )
    d = replace(d, motion=motion, object_pose=d.object_pose[still])
    grip = np.asarray(grip_table([d], [allegro], targets_of(d), np.array([12.0]), allegro.gains))[0]
    np.testing.assert_allclose(grip[0, 6:], touching_grip(d, allegro, 0), atol=1e-6)
    assert np.abs(grip[0]).max() > 0.01


def targets_of(d):
    return jnp.asarray(demonstrated_targets(d))[None]


def touching_grip(d, body, frame: int) -> np.ndarray:
    """What presses with 12 N where the hand is in a frame."""
    model = demonstration_spec(d, body).compile()
    press = Press(Touch(model, body), body, 12.0, body.gains, 0.0)
    press.touch.place(hand_coordinates(model, demonstrated_targets(d)[frame]), d.object_pose[frame])
    return press.offsets()


def test_no_link_is_in_table_or_support(brought, allegro):
    """By MuJoCo's distances, from approach to lift: a larger hand's thumb would be 1 to 4 mm inside the cube's support,
    and of cards and balls 2 cm inside the table."""
    d = brought.demonstration
    model = demonstration_spec(d, allegro).compile()
    data, targets = mujoco.MjData(model), demonstrated_targets(d)
    ground = [g for g in range(model.ngeom) if model.geom_bodyid[g] == 0]
    assert len(ground) > 1
    links = [model.geom(c.name).id for c in allegro.contacts]
    for frame in range(0, d.num_frames, 3):
        data.qpos[:] = np.concatenate([targets[frame], d.object_pose[frame]])
        mujoco.mj_kinematics(model, data)
        assert min(mujoco.mj_geomDistance(model, data, a, b, 0.1, None) for a in links for b in ground) > 0.0, frame


def test_the_ground_goes_with_the_object(demonstrations, hands, allegro):
    """A grasp is sought where the object is carried: there table and support are to it as where it was picked up."""
    scene = RobotScene(demonstrations[1], hands[1], allegro)
    data, ground = scene.touch.data, scene.touch.ground

    def seen_from_the_object() -> np.ndarray:
        pose = data.body(OBJECT).xpos, data.body(OBJECT).xmat.reshape(3, 3)
        places = (data.geom_xpos[ground] - pose[0]) @ pose[1]
        turns = pose[1].T @ data.geom_xmat[ground].reshape(-1, 3, 3)
        return np.concatenate([places[:, None], turns], axis=1)

    scene.place(scene.middle, 0)
    start, world = seen_from_the_object(), data.geom_xpos[ground].copy()
    scene.put_ground(scene.pads.grasp)
    scene.place(scene.middle, scene.pads.grasp)
    np.testing.assert_allclose(seen_from_the_object(), start, atol=1e-9)
    assert np.linalg.norm(data.geom_xpos[ground] - world, axis=1).min() > 0.02
    scene.put_ground(0)
    scene.place(scene.middle, scene.pads.grasp)
    np.testing.assert_allclose(data.geom_xpos[ground], world, atol=1e-9)


def test_the_hand_moves_smoothly_and_within_its_limits(brought, allegro):
    motion = brought.demonstration.motion
    assert motion.joint_names == allegro.joints
    assert np.abs(np.diff(motion.angles, axis=0)).max() * motion.fps < 5.0  # rad/s
    model = demonstration_spec(brought.demonstration, allegro).compile()
    low, high = model.actuator_ctrlrange[6:22].T
    assert (motion.angles >= low - 1e-9).all()
    assert (motion.angles <= high + 1e-9).all()


def test_what_a_robot_cannot_do_is_left_out_with_the_reason(demonstrations, hands, allegro):
    """A hand of which no other finger touches than the thumb; and a cube of ice, which three fingers cannot hold."""
    d = demonstrations[1]
    with pytest.raises(LeftOut, match=r"that touch \(thumb, index, middle\) it needs") as left_out:
        on_robot(d, hands[1], dataclasses.replace(allegro, fingers=("ring", "thumb")))
    assert left_out.value.reason == NO_FINGERS
    ice = replace(d, object=dataclasses.replace(d.object, friction=0.001))
    with pytest.raises(
        LeftOut, match=r"no posture of it has force closure, in the best [0-9]+ links touch"
    ) as left_out:
        on_robot(ice, hands[1], allegro)
    assert left_out.value.reason == NO_CLOSURE


def test_grasps_that_cannot_hold_are_passed_over(demonstrations, hands, allegro, monkeypatch):
    """One that is inside the table is; where none is left the best's reason is told."""
    _, possible = possible_grasps(demonstrations[1], hands[1], allegro)
    assert len(possible) > 1
    for one, other in itertools.combinations(possible, 2):  # many searches end in the same grasp
        assert np.abs(one.targets - other.targets).max() > 0.02
    sunk = dataclasses.replace(possible[0], sunk=0.01)
    monkeypatch.setattr(bring, "find_grasps", lambda scene: [sunk, possible[1]])
    assert possible_grasps(demonstrations[1], hands[1], allegro)[1] == [possible[1]]
    monkeypatch.setattr(bring, "find_grasps", lambda scene: [sunk])
    with pytest.raises(LeftOut, match="its links are 10 mm inside table or support") as left_out:
        possible_grasps(demonstrations[1], hands[1], allegro)
    assert left_out.value.reason == OUT_OF_REACH


@pytest.mark.parametrize(("until", "turned", "most"), [(1.0, 0.3, 4), (0.5, 0.1, 100), (1.0, 0.45, 100)])
def test_what_slips_least_is_rehearsed_first(until, turned, most, demonstrations, hands, allegro, monkeypatch):
    """Four of them, and all where the object is lost or turned with each."""
    slips, made = [], []
    monkeypatch.setattr(bring, "slip", lambda scene, targets: slips.append(targets) or len(slips) % 3)
    monkeypatch.setattr(bring, "follow", lambda scene, grasp: made.append(grasp) or np.tile(grasp, (len(way), 1)))
    monkeypatch.setattr(bring, "rehearse", lambda d, body: Rehearsal(until, 0.05, turned))
    way = demonstrations[1].object_pose
    on_robot(demonstrations[1], hands[1], allegro)
    assert len(slips) > 4
    order = sorted(range(len(slips)), key=lambda k: (k + 1) % 3)[:most]
    for targets, k in zip(made, order, strict=True):
        np.testing.assert_array_equal(targets, slips[k])


def test_the_grasp_that_is_best_in_rehearsal_is_taken(demonstrations, hands, allegro, monkeypatch):
    """No more are rehearsed once the object stays near, nor beyond four once it is held; an object that is lost later
    is better than one that is lost sooner, however far it strays, and one that is turned worse than one that is not."""
    told = [Rehearsal(0.5, 0.02, 0.1), Rehearsal(1.0, 0.05, 0.4), Rehearsal(1.0, 0.05, 0.2), Rehearsal(0.9, 0.01, 0.0)]
    lost, turned = told[0], Rehearsal(1.0, 0.02, 0.45)
    for script, chosen, rehearsed in (
        (told, 2, 4),
        ([told[1], Rehearsal(1.0, 0.009, 0.2), *told], 1, 2),
        ([lost, turned, lost, lost, turned, told[2], turned], 5, 6),
    ):
        made = []
        monkeypatch.setattr(bring, "follow", lambda scene, grasp: np.tile(grasp, (scene.demonstration.num_frames, 1)))
        monkeypatch.setattr(bring, "rehearse", lambda d, body: made.append(d) or script[len(made) - 1])  # noqa: B023
        found = on_robot(demonstrations[1], hands[1], allegro)
        assert len(made) == rehearsed
        assert found.demonstration is made[chosen]
        assert found.rehearsal == script[chosen]


def test_joints_of_fingers_that_touch_are_not_idle(demonstrations, hands, allegro):
    """A last link may hang on the joint itself, which then does not move its origin."""
    scene = RobotScene(demonstrations[1], hands[1], allegro)
    idle = still_targets(scene, FINGERS)
    assert idle.sum() == 4  # the ring finger's
    assert all(allegro.joints[k - 6].endswith(("8.0", "9.0", "10.0", "11.0")) for k in np.flatnonzero(idle))
    scene.last = {finger: k - 1 if finger == "index" else k for finger, k in scene.last.items()}  # a link on its joint
    np.testing.assert_array_equal(still_targets(scene, FINGERS), idle)


def test_a_hand_of_the_other_side_is_refused(demonstrations, hands, allegro):
    left = dataclasses.replace(allegro, side="left")
    with pytest.raises(InputError, match="the demonstration is of a right hand, 'allegro' is a left one"):
        on_robot(demonstrations[1], hands[1], left)


def test_an_environment_of_a_robot_by_its_name(set_path, brought):
    """What it is to follow is what was brought onto it; its actions are as many as its actuators."""
    env = env_of_set(SetSettings("given", folder=str(set_path)), "train", "native", None, set_path, hand="allegro")
    assert env.action_size == 6 + 16
    length = brought.demonstration.num_frames
    wanted = demonstrated_targets(brought.demonstration)
    np.testing.assert_allclose(np.asarray(env.reference.targets)[1, :length], wanted, atol=1e-5)
    held = np.asarray(env.reference.grip)[1, length - 1, 6:]
    assert np.abs(held).max() > 0.01
    with pytest.raises(InputError, match="robot is 'allergo'; valid: ability, allegro"):
        env_of_set(SetSettings("given", folder=str(set_path)), "train", "native", None, set_path, hand="allergo")

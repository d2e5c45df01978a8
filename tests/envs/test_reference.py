import dataclasses

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.grasps import grasp_type
from envs.reference import anticipated, demonstrated_targets, make_reference
from envs.scene import NUM_WRIST, base_rotation, demonstration_spec
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import NUM_HINGES
from mjx_hand.objects.description import OBJECT_KINDS, ObjectDescription
from mjx_hand.pytree import replace
from mjx_hand.rigid.gains import Gains

NUM_TARGETS = NUM_WRIST + NUM_HINGES


@pytest.fixture(scope="module")
def reference(demonstrations, hands):
    return make_reference(demonstrations, hands, grip_force=0.0, gains=Gains())


def test_demonstrations_are_padded_with_their_last_frame(demonstrations, reference):
    lengths = [d.num_frames for d in demonstrations]
    assert len(set(lengths)) > 1  # or nothing is padded here
    np.testing.assert_array_equal(reference.length, lengths)
    assert reference.targets.shape == (len(lengths), max(lengths), NUM_TARGETS)
    for k, (d, n) in enumerate(zip(demonstrations, lengths, strict=True)):
        np.testing.assert_allclose(reference.targets[k, :n, NUM_WRIST:], d.motion.angles, atol=1e-6)
        np.testing.assert_allclose(reference.object_pose[k, :n], d.object_pose, atol=1e-6)
        for rows in (reference.targets[k], reference.object_pose[k]):
            np.testing.assert_array_equal(rows[n:], np.repeat(rows[n - 1 : n], max(lengths) - n, axis=0))


def test_the_bases_and_turns_make_up_the_wrists_orientation(demonstrations, reference):
    for k, d in enumerate(demonstrations):
        turns = Rotation.from_euler("XYZ", np.asarray(reference.targets[k, : d.num_frames, 3:NUM_WRIST]))
        found = Rotation.from_matrix(base_rotation(d)) * turns
        wanted = Rotation.from_quat(d.motion.wrist_quaternion, scalar_first=True)
        assert (found.inv() * wanted).magnitude().max() < 1e-5
        np.testing.assert_allclose(reference.base[k], base_rotation(d), atol=1e-6)
        position = np.asarray(reference.targets[k, : d.num_frames, :3]) @ base_rotation(d).T
        np.testing.assert_allclose(position, d.motion.wrist_position, atol=1e-6)


def test_the_features_say_what_the_object_is(demonstrations, reference):
    for row, d in zip(np.asarray(reference.features), demonstrations, strict=True):
        np.testing.assert_allclose(row[:5], [*d.object.size, d.object.mass, d.object.friction], rtol=1e-6)
        assert [kind for kind, is_it in zip(OBJECT_KINDS, row[5:], strict=True) if is_it] == [d.object.kind]


def tracked(model, controls, start):
    """Where MuJoCo's controllers bring the hand under these controls, the object far away; a row a control step."""
    data = mujoco.MjData(model)
    data.qpos[:NUM_TARGETS] = start
    data.qpos[NUM_TARGETS : NUM_TARGETS + 3] = [0.9, 0.9, 0.1]
    rows = [data.qpos[:NUM_TARGETS].copy()]
    for ctrl in controls[1:]:
        data.ctrl = ctrl
        for _ in range(5):
            mujoco.mj_step(model, data)
        rows.append(data.qpos[:NUM_TARGETS].copy())
    return np.stack(rows)


def test_leading_the_targets_takes_the_controllers_lag_away(demonstrations, hands, reference):
    """In MuJoCo itself: the hand is nearer its demonstration than under the demonstrated targets, by three and more."""
    model = demonstration_spec(demonstrations[0], hands[0]).compile()
    targets = np.asarray(reference.targets[0], float)
    plain = np.abs(tracked(model, targets, targets[0]) - targets)
    led = np.abs(tracked(model, np.asarray(reference.controls[0], float), targets[0]) - targets)
    for part in (slice(0, 3), slice(3, 6), slice(6, 26)):  # slides (m), turns, hinges (rad)
        assert led[:, part].mean() < plain[:, part].mean() / 3, part
    assert led[:, :3].mean() < 0.0005
    assert led[:, 3:].mean() < 0.005


def test_the_lead_is_lag_times_speed(reference):
    """On a steady motion, from the definition: kv/kp late, half a control step early."""
    gains = Gains()
    lead = np.asarray(reference.controls - reference.targets)[0]
    speed = np.asarray(reference.targets)[0, 2:] - np.asarray(reference.targets)[0, :-2]
    speed = speed * 50 / 2
    lag = np.array([180 / 8000] * 3 + [3 / 150] * 3 + list(0.02 / np.sqrt(gains.stiffness)))
    np.testing.assert_allclose(lead[1:-1], (lag - 0.01) * speed, atol=2e-5)


def test_a_grip_is_part_of_the_controls(demonstrations, hands, reference, env):
    grip = np.asarray(env.reference.grip)
    np.testing.assert_array_equal(grip[..., :NUM_WRIST], 0.0)
    assert np.abs(grip).max() > 0.05
    np.testing.assert_allclose(env.reference.controls, reference.controls + grip, atol=1e-6)
    np.testing.assert_array_equal(np.asarray(reference.grip), 0.0)


BALL = ObjectDescription(kind="sphere", size=np.array([0.0165, 0.0, 0.0]), mass=0.1, friction=1.0)


@pytest.mark.slow
def test_kinds_and_types_mix_and_each_is_as_if_it_were_alone(demonstrations, hands, monkeypatch):
    """Controls of a mixed set, in any order, are those of sets of one kind pressed with its own type's force."""
    forces = {"lateral": 2.5, "pinch": 8.0, "spherical": 6.0}
    changed = {name: dataclasses.replace(grasp_type(name), grip_force=force) for name, force in forces.items()}
    monkeypatch.setattr("envs.reference.grasp_type", changed.get)
    first, second = demonstrations
    mixed = [
        replace(second, object=BALL, grasp="lateral"),
        first,
        replace(first, object=BALL, grasp="spherical"),
    ]
    twins = [hands[1], hands[0], hands[0]]
    together = make_reference(mixed, twins, grip_force=None, gains=Gains())
    for k, (d, twin) in enumerate(zip(mixed, twins, strict=True)):
        alone = make_reference([d], [twin], grip_force=forces[d.grasp], gains=Gains())
        assert np.abs(alone.grip).max() > 0.05
        for name in ("targets", "controls", "grip", "object_pose"):
            rows = np.asarray(getattr(together, name)[k, : d.num_frames])
            np.testing.assert_allclose(rows[:-1], getattr(alone, name)[0, : d.num_frames - 1], atol=1e-5, err_msg=name)
        for name in ("base", "features", "length"):
            np.testing.assert_array_equal(getattr(together, name)[k], getattr(alone, name)[0])


def test_a_grasp_of_no_type_needs_to_be_told_its_force(demonstrations, hands):
    wave = [replace(d, grasp="wave") for d in demonstrations]
    with pytest.raises(InputError, match=r"'wave' are of no grasp type \(cylindrical, .*; give task.grip_force"):
        make_reference(wave, hands, grip_force=None, gains=Gains())
    told = make_reference(wave, hands, grip_force=3.0, gains=Gains())
    assert np.abs(told.grip).max() > 0.05


def test_demonstrations_that_do_not_belong_together_are_refused(demonstrations, hands):
    def made(second):
        make_reference([demonstrations[0], second], hands, grip_force=0.0, gains=Gains())

    d = demonstrations[1]
    with pytest.raises(InputError, match=r"several frame rates \(25.0, 50.0\)"):
        made(replace(d, motion=replace(d.motion, fps=25.0)))
    with pytest.raises(InputError, match=r"several sides \(left, right\)"):
        made(replace(d, motion=replace(d.motion, side="left")))
    with pytest.raises(InputError, match="no demonstrations given"):
        make_reference([], [], grip_force=0.0, gains=Gains())


def test_a_recorded_hand_presses_only_when_the_object_is_about_to_move(demonstrations, hands):
    """Reaching along an object it would knock it over; from the first movement on it presses as a type's does."""
    usual = np.asarray(make_reference(demonstrations, hands, grip_force=2.0, gains=Gains()).grip)
    given = [replace(d, grasp="recorded") for d in demonstrations]
    found = np.asarray(make_reference(given, hands, grip_force=2.0, gains=Gains()).grip)
    assert usual.any()
    for k, d in enumerate(demonstrations):
        away = np.linalg.norm(d.object_pose[:, :3] - d.object_pose[0, :3], axis=1) > 0.002
        cosine = np.abs(d.object_pose[:, 3:] @ d.object_pose[0, 3:])
        first = int(np.argmax(away | (2 * np.arccos(np.minimum(cosine, 1.0)) > np.deg2rad(2.0))))
        begin = first - round(0.3 * d.motion.fps)
        assert begin > 0
        assert usual[k, begin].any()  # or there is nothing to leave out
        np.testing.assert_array_equal(found[k, : begin + 1], 0.0)
        np.testing.assert_allclose(found[k, first:], usual[k, first:], rtol=1e-6)
        half = (begin + first) // 2
        share = (half - begin) / (first - begin)
        np.testing.assert_allclose(found[k, half], share * usual[k, half], rtol=1e-5, atol=1e-8)


def test_targets_are_led_alike_by_jax_and_numpy(demonstrations):
    """Rehearsals take NumPy's, which compiles nothing."""
    targets = demonstrated_targets(demonstrations[0])[None]
    found = anticipated(targets, Gains(), 50.0)
    assert isinstance(found, np.ndarray)
    np.testing.assert_allclose(found, np.asarray(anticipated(jnp.asarray(targets), Gains(), 50.0)), atol=1e-5)
    assert np.abs(found - targets).max() > 1e-3

"""Which hand moves an object, when, and where that rests: against recordings that were made up so."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.demonstrations.observation.handling import CARRIED, RESTS
from envs.demonstrations.observation.scene_in_world import handled_object
from envs.demonstrations.observation.settled_path import settled_path, support_boxes
from envs.demonstrations.observation.stillness import object_path
from mjx_hand.errors import InputError
from mjx_hand.motion.gaps import spans
from mjx_hand.motion.make_scene import make_scene, recorded_object
from mjx_hand.retarget.hands import KinematicHands
from tests.envs.demonstrations.observation.acts import AT, AWAY, BOX, FACES, FPS, HALF, motion, scene, smooth, way

TIMES = np.arange(0, 6, 1 / FPS)
UP = np.array([0.0, 0.0, HALF[2]])
TWICE = [(1.5, 2.3, [0, 0, 0.12]), (2.3, 3.0, [0, 0.2, -0.04]), (4.4, 5.2, [0, 0.05, 0.1])]  # put down 8 cm higher
HANDS = KinematicHands()


def hand_with(box: np.ndarray, at: float, off: float, side: str = "right", mirrored: float = 1.0, again: float = 0.0):
    """A hand that comes to the box by `at` (s) and leaves it from `off` on, and again from `again` on, for good."""
    near = smooth(TIMES, at - 0.6, at) * (1 - smooth(TIMES, off, off + 0.6))
    near = np.maximum(near, smooth(TIMES, again - 0.6, again)) if again else near
    offset = AWAY + near[:, None] * (AT - AWAY)
    return motion(box + offset * [mirrored, 1, 1], side)


def settled(handled):
    part = slice(handled.act.begin, handled.act.end)
    path = handled.path
    by_frame = {name: getattr(path, name)[part] for name in ("position", "rotation", "seen", "still")}
    cut = dataclasses.replace(path, **by_frame)
    return settled_path(cut, handled.act.labels, np.tile(np.eye(3), (part.stop - part.start, 1, 1)), handled.solid, FPS)


def test_an_object_that_is_put_down_higher_and_taken_again_rests_twice():
    rng = np.random.default_rng(0)
    box = UP + way(TIMES, TWICE)
    hand = hand_with(box, 1.4, 3.0, again=4.3)
    noise = rng.normal(scale=2e-4, size=box.shape)
    handled = handled_object(scene(box + noise, [hand]), "made up", HANDS)
    assert handled.name == "box"
    assert not handled.act.left_out or set(handled.act.left_out) == set()
    found = settled(handled)
    levels = [rest.level for rest in found.rests]
    assert len([level for level in levels if level < 1e-6]) >= 1
    assert max(levels) == pytest.approx(0.08, abs=0.002)
    carried = handled.act.begin + np.flatnonzero(handled.act.labels == CARRIED)
    assert 1.2 < TIMES[carried[0]] < 1.75
    assert (np.diff(carried) > 1).any()  # it rests in between
    halves, centres = support_boxes(found.rests, handled.solid)
    assert len(halves) == 1
    assert centres[0][2] + halves[0][2] == pytest.approx(max(levels))
    first = handled.act.begin
    there = found.rests[-1]
    height = (BOX @ there.rotation.T + there.position)[:, 2].min()
    assert height == pytest.approx(there.level, abs=1e-9)
    np.testing.assert_allclose(found.position[0], [0, 0, HALF[2]], atol=1e-6)
    away = found.position - found.position[0] - (box - box[first])[handled.act.begin - first :][: len(found.position)]
    assert np.abs(away).max() < 0.003


@pytest.mark.parametrize("seed", range(4))
def test_up_is_found_from_a_box_that_stands_and_is_lifted(seed):
    rng = np.random.default_rng(seed)
    box = UP + way(TIMES, [(1.5, 2.5, [0, 0, 0.15]), (2.5, 3.5, [0.2, 0.1, 0])])
    turn = Rotation.random(rng=rng)
    tilted = scene(
        box + rng.normal(scale=5e-4, size=box.shape), [hand_with(box, 1.4, 9)], turn, rng.normal(size=3), up=None
    )
    handled = handled_object(tilted, "made up", HANDS)
    assert np.arccos(np.clip(handled.world[2] @ turn.apply([0, 0, 1]), -1, 1)) < np.deg2rad(1.0)
    np.testing.assert_allclose(handled.world @ handled.world.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(handled.world) > 0


def test_an_object_set_down_on_another_face_lies_flat_on_it():
    box = UP + way(TIMES, [(1.5, 2.3, [0, 0, 0.12]), (2.3, 3.2, [0, 0, -0.12 - HALF[2] + HALF[0]])])
    angle = smooth(TIMES, 1.7, 2.9) * np.deg2rad(88)  # two degrees off, as captured
    spin = Rotation.from_rotvec(angle[:, None] * [0.0, 1.0, 0.0])
    handled = handled_object(scene(box, [hand_with(box, 1.4, 9)], spin=spin), "made up", HANDS)
    found = settled(handled)
    last = found.rests[-1]
    assert np.abs(last.rotation[2] @ [1, 0, 0]) == pytest.approx(1, abs=1e-9)
    assert last.position[2] == pytest.approx(HALF[0], abs=1e-6)


def test_what_the_other_hand_does_is_left_out():
    box = UP + way(TIMES, [(1.5, 2.3, [0, 0, 0.1]), (2.3, 2.9, [0, 0.1, -0.1]), (4.4, 5.4, [0, -0.3, 0.1])])
    right = hand_with(box, 1.4, 3.0)
    left = hand_with(box, 4.2, 9, "left", -1.0)
    handled = handled_object(scene(box, [right, left]), "made up", HANDS, side="right")
    assert handled.motion.side == "right"
    assert handled.act.end <= 4.4 * FPS + 10
    (spans_,) = [s for why, s in handled.act.left_out.items() if "other hand" in why]
    assert abs(spans_[0][0] - 4.4 * FPS) < 20
    other = handled_object(scene(box, [right, left]), "made up", HANDS, side="left")
    assert other.act.begin > 2.2 * FPS
    assert other.act.labels[0] == RESTS


def test_still_and_moving_frames_are_told_in_noise():
    rng = np.random.default_rng(0)
    box = UP + way(TIMES, [(2.0, 3.0, [0.2, 0, 0])]) + rng.normal(scale=0.002, size=(len(TIMES), 3))
    path = object_path(
        recorded_object("box", np.concatenate([box, np.tile([1.0, 0, 0, 0], (len(TIMES), 1))], axis=1)), FPS
    )
    (moving,) = spans(~path.still)
    assert 1.8 < TIMES[moving[0]] < 2.4
    assert 2.6 < TIMES[moving[1] - 1] < 3.2
    assert path.place_noise == pytest.approx(0.002 * np.sqrt(3), rel=0.2)


def floating():
    box = UP + way(TIMES, [(1.5, 2.5, [0, 0, 0.15])])
    return scene(box, [hand_with(np.tile(UP + np.array([0.0, 0.6, 0]), (len(box), 1)), 1.4, 9)])


def held_at_once():
    box = UP + np.array([0, 0, 0.2]) + TIMES[:, None] * np.array([0, 0.1, 0.02])
    return scene(box, [hand_with(box, -2, 9)])


def without(what: str):
    box = np.tile(UP, (len(TIMES), 1))
    if what == "hand":
        pose = np.concatenate([box, np.tile([1.0, 0, 0, 0], (len(box), 1))], axis=1)
        return make_scene([], recorded_object("box", pose, mesh=(BOX, FACES)), fps=FPS)
    if what == "object":
        return make_scene([hand_with(box, 1.4, 9)])
    pose = np.concatenate([box, np.tile([1.0, 0, 0, 0], (len(box), 1))], axis=1)
    mesh = (1000 * BOX, FACES) if what == "metres" else None
    return make_scene([hand_with(box, 1.4, 9)], recorded_object("box", pose, mesh=mesh), up="+z")


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (floating, "no demonstration is in it: object 'box', right hand: this hand never moves it"),
        (held_at_once, "never seen at rest before the hand has it"),
        (lambda: without("hand"), "objects without a hand; give"),
        (lambda: without("object"), "a hand without an object; add"),
        (lambda: without("mesh"), "poses without a mesh; add"),
        (lambda: without("metres"), r"in millimetres\? scale it by 0.001"),
        (lambda: scene(np.tile(UP, (300, 1)), [motion(np.tile(AWAY, (300, 1)))]), "this hand never moves it"),
    ],
)
def test_what_cannot_be_a_demonstration_is_said_in_one_line(made, words):
    with pytest.raises(InputError, match=words) as caught:
        handled_object(made(), "made up", HANDS)
    assert "\n" not in str(caught.value)

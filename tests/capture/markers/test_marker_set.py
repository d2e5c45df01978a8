"""Marker sets, marker recordings and their files."""

import dataclasses

import numpy as np
import pytest

from mjx_hand.capture.markers.marker_places import first_hit, parse_places, skin_vertex
from mjx_hand.capture.markers.marker_recording import (
    MarkerRecording,
    check_recording,
    load_recording_file,
    save_recording,
    select_markers,
)
from mjx_hand.capture.markers.marker_set import (
    MarkerSet,
    included_marker_set,
    load_marker_set,
    place_markers,
    rest_offsets,
)
from mjx_hand.errors import InputError
from mjx_hand.hand.joints import LINKS
from mjx_hand.hand.load import load_hand


def test_included_set_sits_where_its_names_say(hand, marker_set):
    assert len(marker_set.names) == 22
    centres = hand.joint_regressor @ hand.template
    where = dict(zip(marker_set.names, hand.template[marker_set.vertices], strict=True))
    out = dict(zip(marker_set.names, rest_offsets(marker_set, hand), strict=True))
    for finger in ("index", "middle", "ring", "pinky"):
        for k, place in enumerate(("mcp", "pip", "dip"), start=1):
            joint = centres[LINKS.index(f"{finger}{k}")]
            off = where[f"{finger}_{place}"] - joint
            assert 0 < off[1] < 0.02  # on the dorsal side
            assert np.hypot(off[0], off[2]) < 0.006  # straight over the joint, within the mesh's resolution
            assert out[f"{finger}_{place}"][1] > 0.004  # and the offset points off the back of the hand
        tip = hand.template[hand.tip_vertices[("index", "middle", "pinky", "ring", "thumb").index(finger)]]
        assert np.linalg.norm(where[f"{finger}_nail"] - tip) < 0.015
    assert where["wrist_radial"][2] > centres[0, 2] + 0.015
    assert where["wrist_ulnar"][2] < centres[0, 2] - 0.015
    np.testing.assert_allclose(np.linalg.norm(rest_offsets(marker_set, hand), axis=1), 0.005)


def test_left_set_mirrors_the_right(hand, marker_set):
    left = load_hand(side="left")
    mirrored = left.template[included_marker_set(left).vertices] * [-1, 1, 1]
    np.testing.assert_allclose(mirrored, hand.template[marker_set.vertices], atol=0.004)


def test_ray_against_a_known_triangle():
    triangles = np.array([[[0, 0, 2], [1, 0, 2], [0, 1, 2]], [[0, 0, 1], [1, 0, 1], [0, 1, 1]]], float)
    up = np.array([0.0, 0.0, 1.0])
    hit = first_hit(np.array([0.2, 0.3, 0.0]), up, triangles)
    assert hit is not None
    assert hit[0] == 1  # the nearer
    np.testing.assert_allclose(hit[1], [0.2, 0.3, 1.0])
    assert first_hit(np.array([0.8, 0.8, 0.0]), up, triangles) is None
    assert first_hit(np.array([0.2, 0.3, 3.0]), up, triangles) is None  # behind the ray


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("markers: [", "not YAML"),
        ("a: 1", "not a marker set"),
        (
            "markers: {a: {vertex: 3, offset: 0}, b: {vertex: 4, offset: 0}, a: {vertex: 5, offset: 0}}",
            "'a' is .* twice",
        ),
        ("markers: {}", "not a marker set"),
        ("unit: mm\nmarkers: {a: {joint: wrist, facing: dorsal, offset: 0}}", "unknown entry 'unit'"),
        ("markers: {a: 3}", "3 is not a place"),
        ("markers: {a: {joint: wrst, facing: dorsal, offset: 0}}", "joint is 'wrst'; valid are wrist, index1"),
        ("markers: {a: {joint: wrist, facing: up, offset: 0}}", "facing is 'up'; valid are dorsal"),
        ("markers: {a: {joint: wrist, offset: 0}}", "facing is None"),
        ("markers: {a: {joint: wrist, facing: [dorsal, palmar], offset: 0}}", "cancels out"),
        ("markers: {a: {joint: wrist, facing: dorsal}}", "offset is None, expected a number from 0 to 0.05"),
        ("markers: {a: {joint: wrist, facing: dorsal, offset: 5}}", "offset is 5, expected a number from 0 to 0.05"),
        ("markers: {a: {joint: wrist, facing: dorsal, offset: 0, along: -1}}", "along is -1"),
        ("markers: {a: {joint: wrist, facing: dorsal, offset: 0, colour: red}}", "unknown entry 'colour'"),
        ("markers: {a: {vertex: 3, facing: dorsal, offset: 0}}", "give either a vertex"),
        ("markers: {a: {vertex: -1, offset: 0}}", "give either a vertex"),
        ("markers: {a: {vertex: 3, offset: 0, within: 0}}", "within is 0"),
        ("markers: {a: {vertex: 3, offset: 0, labels: ['(']}}", "labels has '\\(', which is not a regular expression"),
        ("markers: {a: {vertex: 3, offset: 0, labels: [3]}}", "labels has 3"),
        ("!!python/object/apply:os.system ['true']", "not YAML"),
    ],
)
def test_bad_marker_sets_are_refused(text, message):
    with pytest.raises(InputError, match=message):
        parse_places(text, "set.yaml")


def test_marker_set_file(tmp_path, hand):
    path = tmp_path / "set.yaml"
    path.write_text("offset: 0.01\nmarkers:\n  back: {joint: wrist, along: 0.5, facing: dorsal}\n")
    assert load_marker_set(path, hand).names == ("back",)
    with pytest.raises(InputError, match="no such marker set; give a YAML file, or one of hand22, glove13"):
        load_marker_set(tmp_path / "none.yaml", hand)


def test_vertices_other_labels_and_how_exactly_a_place_is_known(hand):
    text = """
    offset: 0.004
    within: 0.002
    markers:
      a: {vertex: 12, labels: [A1, 'A\\d+']}
      b: {joint: index2, facing: dorsal, within: 0.008, labels: B}
    """
    marker_set = place_markers(parse_places(text, "set"), hand)
    assert marker_set.vertices[0] == 12
    assert marker_set.labels == (("A1", r"A\d+"), ("B",))
    np.testing.assert_allclose(marker_set.place_deviation, [0.002, 0.008])
    with pytest.raises(InputError, match=r"vertex 99999, but open hand has \d+; the set is for another hand"):
        place_markers(parse_places("markers: {a: {vertex: 99999, offset: 0}}", "set"), hand)


def test_the_gloves_set_lies_on_the_back_of_the_hand(hand):
    glove = included_marker_set(hand, "glove13")
    assert len(glove.names) == 13
    where = dict(zip(glove.names, hand.template[glove.vertices], strict=True))
    for finger in ("index", "middle", "ring", "little"):
        assert where[f"{finger}_tip"][0] < where[f"{finger}_middle"][0] - 0.015  # fingers point along -x
    assert where["hand_left"][2] > where["hand_right"][2] + 0.010  # the thumb's side is +z
    assert (rest_offsets(glove, hand)[:3, 1] > 0.005).all()


def test_places_off_the_hand_and_doubles_are_refused(hand):
    text = "offset: 0\nmarkers:\n  a: {joint: index2, facing: dorsal}\n  b: {joint: index2, facing: dorsal}\n"
    with pytest.raises(InputError, match="'a' and 'b' both fall on vertex"):
        place_markers(parse_places(text, "set"), hand)
    hollow = dataclasses.replace(hand, faces=hand.faces[:1])
    with pytest.raises(InputError, match="does not meet the skin"):
        skin_vertex(parse_places(text, "set")[0], hollow)


def test_marker_set_is_checked():
    with pytest.raises(InputError, match="repeat: a"):
        MarkerSet(names=("a", "a"), vertices=np.array([1, 2]), offsets=np.zeros(2))
    with pytest.raises(InputError, match="2 names, 1 vertices"):
        MarkerSet(names=("a", "b"), vertices=np.array([1]), offsets=np.zeros(1))
    with pytest.raises(InputError, match=r"'b': offset 5\.0"):
        MarkerSet(names=("a", "b"), vertices=np.array([1, 2]), offsets=np.array([0.0, 5.0]))


@pytest.fixture
def recording() -> MarkerRecording:
    rng = np.random.default_rng(0)
    visible = rng.random((6, 3)) < 0.7
    positions = np.where(visible[..., None], rng.normal(size=(6, 3, 3)), 0.0)
    return MarkerRecording(fps=120.0, positions=positions, visible=visible, names=("a", "b", "ç"), source="test")


def test_recording_file_round_trip(tmp_path, recording):
    save_recording(recording, tmp_path / "r.npz")
    back = load_recording_file(tmp_path / "r.npz")
    np.testing.assert_array_equal(back.positions, recording.positions)
    np.testing.assert_array_equal(back.visible, recording.visible)
    assert (back.names, back.fps, back.source) == (recording.names, recording.fps, recording.source)


def test_bad_recordings_are_refused(recording):
    nan = recording.positions.copy()
    nan[2, 1] = np.nan
    for change, message in (
        ({"positions": nan}, "marker 'b' is NaN or infinite in frame 2"),
        ({"names": ("a", "b", "a")}, "names repeat: a"),
        ({"names": ("a", "b")}, r"positions has shape \(6, 3, 3\), expected \(6, 2, 3\)"),
        ({"fps": 0.0}, "fps is 0"),
        ({"positions": nan[:0], "visible": recording.visible[:0]}, "0 frames"),
    ):
        with pytest.raises(InputError, match=message):
            check_recording(dataclasses.replace(recording, **change))
    with pytest.raises(InputError, match="no marker 'x'; it has a, b"):
        select_markers(recording, ["a", "x"])

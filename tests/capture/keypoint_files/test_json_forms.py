"""The forms in which devices and packages write a hand's joints in JSON."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.capture.keypoint_fit.fit import fit_keypoints
from mjx_hand.capture.keypoints.layouts import KEYPOINTS, LAYOUTS, from_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import Motion
from tests.capture.keypoints.grips import grip, keypoints_of

HAND = keypoints_of(grip())[:12]
PIPS = np.array([[k + 0, k + 1, k + 2] for k in (5, 9, 13, 17)])  # knuckle, middle and last joint of four fingers


def write(path: Path, value: object) -> Path:
    path.write_text(json.dumps(value))
    return path


def xyz(points: np.ndarray) -> list[dict[str, float]]:
    return [dict(zip("xyz", map(float, p), strict=True)) for p in points]


def named(layout: str, points: np.ndarray, form) -> dict[str, object]:
    full = np.nan_to_num(from_keypoints(points, LAYOUTS[layout]), nan=0.01)
    return {name: form(p) for name, p in zip(LAYOUTS[layout].joints, full, strict=True)}


def by_columns(p: np.ndarray) -> list[float]:
    return [0.0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, *map(float, p), 1]


def by_rows(p: np.ndarray) -> list[float]:
    return np.array(by_columns(p)).reshape(4, 4).T.ravel().tolist()


PLACES = {
    "worldPosition beside a relative one": lambda p: {"position": [0, 0, 0], "worldPosition": p.tolist()},
    "transform.position": lambda p: {"transform": {"position": xyz(p[None])[0]}, "radius": 0.01},
    "pose.position": lambda p: {"pose": {"position": xyz(p[None])[0], "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}},
    "a matrix by columns": lambda p: {"transform": {"matrix": by_columns(p)}},
    "a matrix by rows": lambda p: {"offsetMatrix": by_rows(p)},
    "a matrix of rows": lambda p: np.array(by_rows(p)).reshape(4, 4).tolist(),
    "a matrix of three rows": lambda p: {"pose": np.array(by_rows(p)).reshape(4, 4)[:3].tolist()},
    "a Float32Array": lambda p: {"matrix": {str(k): v for k, v in enumerate(by_columns(p))}},
}


@pytest.mark.parametrize("form", PLACES)
@pytest.mark.parametrize("layout", ["webxr", "openxr", "mrtk"])
def test_joints_by_name_in_every_form_of_a_place(tmp_path, form, layout):
    frames = [named(layout, points, PLACES[form]) for points in HAND]
    found = load_keypoints(write(tmp_path / "in.json", {"fps": 30, "side": "right", "frames": frames}))
    np.testing.assert_allclose(found.positions, HAND, atol=1e-9)
    assert found.side == "right"


def test_joints_listed_with_their_names(tmp_path):
    frames = [
        {"items": [{"joint": "None", "pose": {"position": [9, 9, 9]}}]
         + [{"joint": n, "pose": {"position": p}} for n, p in named("mrtk", points, lambda p: p.tolist()).items()]}
        for points in HAND
    ]  # fmt: skip
    np.testing.assert_allclose(load_keypoints(write(tmp_path / "in.json", frames)).positions, HAND)


def test_joints_of_which_only_turns_are_known_are_no_points(tmp_path):
    frames = [named("webxr", points, lambda p: {"quaternion": [0, 0, 0, 1]}) for points in HAND]
    with pytest.raises(InputError, match=r"in\.json: no keypoint file .* wrist \(quaternion"):
        load_keypoints(write(tmp_path / "in.json", frames))


LABEL = [{"index": 1, "score": 0.9, "label": "Right", "categoryName": "Right"}]
RESULTS = {
    "Tasks": lambda p: {"landmarks": [xyz(p * 3)], "worldLandmarks": [xyz(p)], "handedness": [LABEL]},
    "JavaScript": lambda p: {
        "multiHandLandmarks": [xyz(p * 3)],
        "multiHandWorldLandmarks": [xyz(p)],
        "multiHandedness": LABEL,
    },
    "MessageToDict": lambda p: {
        "multi_hand_world_landmarks": [{"landmark": xyz(p)}],
        "multi_handedness": [{"classification": LABEL}],
    },
    "camel case": lambda p: {"multiHandWorldLandmarks": [{"landmark": xyz(p)}]},
    "a landmark list": lambda p: {"landmark": xyz(p)},
    "TensorFlow.js": lambda p: [
        {
            "keypoints": [{"x": 300.0, "y": 200.0, "name": name} for name in KEYPOINTS],
            "keypoints3D": [{**each, "name": name} for each, name in zip(xyz(p), KEYPOINTS, strict=True)],
            "handedness": "Left",
            "score": 0.9,
        }
    ],
    "Holistic": lambda p: {"right_hand_world_landmarks": xyz(p), "left_hand_world_landmarks": None},
    "Holistic, JavaScript": lambda p: {
        "rightHandWorldLandmarks": [xyz(p)],
        "leftHandWorldLandmarks": [],
        "poseWorldLandmarks": xyz(np.zeros((33, 3))),
        "rightHandLandmarks": [xyz(p * 3)],
    },
}


@pytest.mark.parametrize("form", RESULTS)
def test_results_of_mediapipe(tmp_path, form):
    frames = [RESULTS[form](points) for points in HAND]
    found = load_keypoints(write(tmp_path / "in.json", frames), fps=30.0)
    np.testing.assert_allclose(found.positions, HAND, atol=1e-12)
    alone = load_keypoints(write(tmp_path / "one.json", RESULTS[form](HAND[3])))
    np.testing.assert_allclose(alone.positions, HAND[3:4], atol=1e-12)
    (tmp_path / "in.jsonl").write_text("".join(f"{json.dumps(frame)}\n" for frame in frames))
    np.testing.assert_allclose(load_keypoints(tmp_path / "in.jsonl").positions, HAND, atol=1e-12)


CONTAINERS = {
    "an object": lambda frames: {"frames": frames, "unit": "MM"},
    "an object in an object": lambda frames: {"recording": {"frames": frames}, "unit": "millimeters"},
    "data": lambda frames: {"data": frames, "unit": "mm"},
    "the points' name": lambda frames: {"joints": frames, "unit": "mm"},
    "by number": lambda frames: {"frames": {str(k): frame for k, frame in enumerate(frames)}, "unit": "mm"},
    "by hand": lambda frames: {"Right": frames, "unit": "mm"},
}


@pytest.mark.parametrize("container", CONTAINERS)
def test_where_frames_stand(tmp_path, container):
    value = CONTAINERS[container]((1000 * HAND).tolist()) | {"fps": 25}
    found = load_keypoints(write(tmp_path / "in.json", value))
    np.testing.assert_allclose(found.positions, HAND, atol=1e-9)
    assert found.fps == 25
    assert found.side == ("right" if container == "by hand" else "")


def test_landmarks_of_the_image_are_no_places(tmp_path):
    for frame in (
        lambda p: {"landmarks": [xyz(p)], "handedness": [LABEL]},
        lambda p: {"multi_hand_landmarks": [xyz(p)]},
        lambda p: {"rightHandLandmarks": xyz(p)},
    ):
        with pytest.raises(InputError, match="landmarks of the image"):
            load_keypoints(write(tmp_path / "in.json", [frame(p) for p in HAND]))


@pytest.mark.parametrize("nothing", [None, [], [[]], "no key"])
@pytest.mark.parametrize("keys", [("landmarks", "worldLandmarks"), ("multiHandLandmarks", "multiHandWorldLandmarks")])
def test_a_frame_without_world_landmarks_is_a_gap(tmp_path, nothing, keys):
    frames = [{keys[0]: [xyz(3 * p)], keys[1]: [xyz(p)]} for p in HAND]
    frames[4][keys[1]] = nothing
    if nothing == "no key":
        del frames[4][keys[1]]
    expected = HAND.copy()
    expected[4] = np.nan
    np.testing.assert_allclose(load_keypoints(write(tmp_path / "in.json", frames)).positions, expected)


@pytest.mark.parametrize(
    "frame",
    [
        {"hands": None, "pointables": []},
        {"hands": [1, {"id": 3, "type": []}], "pointables": [None, {"handId": 3, "type": []}]},
        {"hands": [], "pointables": None},
        {"worldLandmarks": {"landmark": {"landmark": 3}}},
        {"landmarks": [[{"x": True, "y": "0", "z": None}] * 21]},
        {"joints": [[1e400] * 3] * 21},
        [[[[[[[[[[[[[[[[[[[[1, 2, 3]]]]]]]]]]]]]]]]]]]],
        {"handedness": [[[[[[[[[[[[["Left"]]]]]]]]]]]]], "keypoints": {}},
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(tmp_path, frame):
    for value in ([frame, frame], {"frames": [frame], "layout": [1]}, frame):
        with pytest.raises(InputError) as caught:
            load_keypoints(write(tmp_path / "in.json", value))
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 800


def bends(points: np.ndarray) -> np.ndarray:
    """Degrees between the bones at the four fingers' middle joints."""
    first, second = (points[:, PIPS[:, k + 1]] - points[:, PIPS[:, k]] for k in (0, 1))
    cosine = (first * second).sum(-1) / np.linalg.norm(first, axis=-1) / np.linalg.norm(second, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def fitted(found: KeypointRecording, fps: float = 30.0) -> tuple[Motion, np.ndarray]:
    motion, report = fit_keypoints(
        KeypointRecording(fps=found.fps or fps, positions=found.positions, side=found.side, layout=found.layout),
        load_hand(side=found.side),
    )
    return motion, report.fitted


def test_every_posture_of_handy_js(recordings, tmp_path):
    script = recordings / "handyjs" / "Handy-poses-right.js"
    rows = [json.loads(row) for row in re.findall(r'^\s*(\{"names".*\}),?\s*$', script.read_text(), re.M)]
    right = np.array([row["jointPositions"] for row in rows], float)[:, [0, 1, 2, 3, 4, *range(6, 10), *range(11, 15),
                                                                       *range(16, 20), *range(21, 25)]]  # fmt: skip
    for path in (script, write(tmp_path / "poses.json", rows)):
        found = load_keypoints(path)
        assert (found.num_frames, found.side, found.layout, found.fps) == (55, "right", "webxr", None)
        motion, points = fitted(found)
        assert motion.valid.all()
        assert np.abs(bends(points) - bends(right)).max() < 0.1
    alone = load_keypoints(write(tmp_path / "alone.json", rows[20]))
    np.testing.assert_allclose(alone.positions[0], found.positions[20])


def test_joints_of_iwer(recordings, tmp_path):
    for name in ("pinch", "point", "relaxed"):
        path = recordings / "iwer_poses" / f"iwer_{name}_raw.json"
        pose = json.loads(path.read_text())["jointTransforms"]
        right = np.array([[pose[joint]["offsetMatrix"][12:15] for joint in pose]])[:, [0, 1, 2, 3, 4, *range(6, 10),
                                     *range(11, 15), *range(16, 20), *range(21, 25)]]  # fmt: skip
        np.testing.assert_allclose(load_keypoints(path).positions, right)
        frames = load_keypoints(write(tmp_path / "in.json", [pose] * 3))
        np.testing.assert_allclose(frames.positions, np.repeat(right, 3, axis=0))


def recorded_bends(rows: list[dict], hand: int) -> np.ndarray:
    """Of Leap's recorder, from the joints as they stand in the file."""
    made = []
    for row in rows:
        own = {p.get("type", p["id"] % 10): p for p in row["pointables"] if p["handId"] == hand}
        made.append([[own[f][f"{j}Position"] for j in ("mcp", "pip", "dip")] for f in (1, 2, 3, 4)])
    at = np.array(made)
    a, b = at[:, :, 1] - at[:, :, 0], at[:, :, 2] - at[:, :, 1]
    cosine = (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def test_recordings_of_leaps_own_recorder(recordings):
    folder = recordings / "leap_recorder"
    wave = json.loads((folder / "wave.json").read_text())["frames"]
    header, *packed = json.loads((folder / "pinch-57fps.json").read_text())["frames"]
    inner = header[3]["pointables"][0]
    pinch = [{"timestamp": row[1], "pointables": [dict(zip(inner, p, strict=False)) for p in row[3]]} for row in packed]
    for name, rows, hand in (("wave", wave, 11), ("pinch-57fps", pinch, 87)):
        stamps = np.array([row["timestamp"] for row in rows]) / 1e6
        for suffix in (".json", ".json.lz") if name == "wave" else (".json",):
            found = load_keypoints(folder / f"{name}{suffix}")
            _, points = fitted(found)
            assert (found.num_frames - 1) / (found.fps or 0) == pytest.approx(stamps[-1] - stamps[0], abs=0.02)
            right = recorded_bends(rows, hand)
            times = stamps[0] + np.arange(found.num_frames) / (found.fps or 0)
            nearest = np.abs(times[:, None] - stamps[None]).argmin(axis=1)
            exact = np.abs(times - stamps[nearest]) < 0.0005
            assert exact.sum() > 5
            assert np.abs(bends(points) - right[nearest])[exact].max() < 1.5
    left = load_keypoints(folder / "three-claps.json.lz", side="left")
    assert (left.side, left.layout) == ("left", "leap_bones")
    assert (left.num_frames - 1) / (left.fps or 0) == pytest.approx(3.72, abs=0.02)

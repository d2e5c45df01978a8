"""Keypoint files: what each device writes is read as it was, and what cannot be read says why in one line."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mjx_hand.capture.keypoint_files.load_keypoints import load_keypoints
from mjx_hand.capture.keypoints.layouts import LAYOUTS, KeypointLayout, from_keypoints
from mjx_hand.capture.keypoints.recording import KeypointRecording, load_keypoint_file, save_keypoints
from mjx_hand.capture.load import load_motion
from mjx_hand.errors import InputError
from tests.capture.keypoints.grips import FPS, grip, keypoints_of

POINTS = {side: keypoints_of(grip(side))[:30] for side in ("right", "left")}
GAP = 11  # a frame in which no hand is seen


def named(layout: KeypointLayout, points: np.ndarray, form: str) -> dict:
    """One frame's joints by name, as an application would save them; joints outside the 21 somewhere in the palm."""
    full = np.nan_to_num(from_keypoints(points, layout), nan=0.01)
    write = {
        "list": lambda p: p.tolist(),
        "xyz": lambda p: dict(zip("xyz", p.tolist(), strict=True)),
        "pose": lambda p: {"position": dict(zip("xyz", p.tolist(), strict=True)), "orientation": [1, 0, 0, 0]},
    }[form]
    return {name: write(p) for name, p in zip(layout.joints, full, strict=True)}


def mediapipe_frame(hands: dict[str, np.ndarray]) -> dict:
    """MediaPipe's result for one image; its handedness is that of a mirrored image, and so the other one."""
    listed = [[{"x": x, "y": y, "z": z, "visibility": 0} for x, y, z in p.tolist()] for p in hands.values()]
    image = [[{"x": 0.5, "y": 0.5, "z": 0.0}] * 21 for _ in hands]
    labels = [[{"score": 0.98, "index": 0, "categoryName": "Left" if s == "right" else "Right"}] for s in hands]
    return {"landmarks": image, "worldLandmarks": listed, "handedness": labels}


def leap_frame(hands: dict[str, np.ndarray], number: int) -> dict:
    layout = LAYOUTS["leap_bones"]
    frame = {"id": number, "timestamp": 1_000_000 + round(number / FPS * 1e6), "hands": [], "pointables": []}
    for k, (side, points) in enumerate(hands.items()):
        full = np.nan_to_num(from_keypoints(1000 * points, layout), nan=1.0)
        frame["hands"].append({"id": 40 + k, "type": side, "wrist": full[0].tolist(), "palmPosition": [0, 0, 0]})
        for finger in range(5):
            joints = dict(zip(("carp", "mcp", "pip", "dip", "btip"), full[1 + 5 * finger :].tolist(), strict=False))
            bones = {f"{name}Position": place for name, place in joints.items()}
            frame["pointables"].append({"handId": 40 + k, "type": finger, **bones})
    return frame


def write_json(path: Path, frames: list, **said: object) -> Path:
    path.write_text(json.dumps({**said, "frames": frames} if said else frames))
    return path


def check(found: KeypointRecording, side: str = "right", lacking: tuple[int, ...] = (), gap: bool = True) -> None:
    expected = POINTS[side].copy()
    expected[:, list(lacking)] = np.nan
    if gap:
        expected[GAP] = np.nan
    np.testing.assert_allclose(found.positions, expected, atol=1e-6)
    assert found.fps == pytest.approx(FPS, rel=1e-3)


@pytest.mark.parametrize(
    "layout", [layout for layout in LAYOUTS.values() if layout.name != "leap"], ids=lambda layout: layout.name
)
@pytest.mark.parametrize("form", ["list", "xyz", "pose"])
def test_joints_by_name(tmp_path, layout, form):
    frames = [{"time": k / FPS, "joints": named(layout, points, form)} for k, points in enumerate(POINTS["right"])]
    frames[GAP]["joints"] = None
    found = load_keypoints(write_json(tmp_path / "hand.json", frames, side="right"))
    check(found)
    assert found.side == "right"


def test_mediapipe_results_of_two_hands(tmp_path):
    frames = [mediapipe_frame({s: POINTS[s][k] for s in POINTS}) for k in range(30)]
    frames[GAP] = {"landmarks": [], "worldLandmarks": [], "handedness": []}
    path = write_json(tmp_path / "hands.json", frames, fps=FPS)
    for side in ("right", "left"):
        check(load_keypoints(path, side=side), side)
    with pytest.raises(InputError, match=r"holds 2 hands \(left, right\); choose with side="):
        load_keypoints(path)
    assert load_motion(path, side="left").side == "left"


def test_mediapipe_label_of_a_mirrored_image_does_not_mislead(tmp_path):
    frames = [mediapipe_frame({"right": points}) for points in POINTS["right"]]  # it says Left
    assert load_motion(write_json(tmp_path / "hand.json", frames, fps=FPS)).side == "right"


def test_leap_frames(tmp_path):
    frames = [leap_frame({s: POINTS[s][k] for s in POINTS}, k) for k in range(30)]
    path = write_json(tmp_path / "leap.json", frames)
    for side, name in (("right", "right_40"), ("left", "left_41")):
        check(load_keypoints(path, sequence=name), side, gap=False)
        check(load_keypoints(path, side=side), side, gap=False)


def test_plain_lists_and_both_hands_by_name(tmp_path):
    listed = [points.tolist() for points in POINTS["right"]]
    listed[GAP] = None
    check(load_keypoints(write_json(tmp_path / "list.json", listed), fps=FPS))
    flat = [points.ravel().tolist() for points in POINTS["right"]]
    check(load_keypoints(write_json(tmp_path / "flat.json", flat), fps=FPS), gap=False)
    both = [{"left": POINTS["left"][k].tolist(), "right": POINTS["right"][k].tolist()} for k in range(30)]
    path = write_json(tmp_path / "both.json", both, frame_rate=FPS)
    check(load_keypoints(path, side="left"), "left", gap=False)
    assert load_keypoints(path, side="left").side == "left"


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("cm", 100.0), ("mm", 1000.0)])
def test_units_said_in_the_file_or_by_the_caller(tmp_path, unit, factor):
    scaled = factor * POINTS["right"]
    np.savez(tmp_path / "said.npz", joints=scaled, fps=FPS, unit=unit, side="right")
    check(load_keypoints(tmp_path / "said.npz"), gap=False)
    np.savez(tmp_path / "unsaid.npz", joints=scaled, fps=FPS)
    check(load_keypoints(tmp_path / "unsaid.npz", unit=unit), gap=False)


def test_arrays_with_names_times_and_two_hands(tmp_path):
    layout = LAYOUTS["openxr"]
    times = np.arange(30) / FPS * 1e3  # ms
    both = {side: np.nan_to_num(from_keypoints(POINTS[side], layout), nan=0.0) for side in POINTS}
    names = np.array(layout.joints)
    np.savez(tmp_path / "both.npz", left=both["left"], right=both["right"], t=times, names=names)
    check(load_keypoints(tmp_path / "both.npz", side="left"), "left", gap=False)
    np.savez(tmp_path / "leap.npz", positions=from_keypoints(POINTS["right"], LAYOUTS["leap"]), fps=FPS)
    check(load_keypoints(tmp_path / "leap.npz"), lacking=(0,), gap=False)


def test_leap_arrays_are_brought_to_an_even_rate(tmp_path):
    points = from_keypoints(1000 * POINTS["right"], LAYOUTS["leap"]).reshape(30, 5, 4, 3)
    kept = np.setdiff1d(np.arange(30), [GAP])  # the device dropped a frame
    arrays = {"t": np.arange(30)[kept] / FPS, "right_7_joints_mm": points[kept], "right_7_frame": np.arange(29)}
    np.savez(tmp_path / "leap.npz", **arrays)
    check(load_keypoints(tmp_path / "leap.npz"), lacking=(0,))


def test_tables(tmp_path):
    layout = LAYOUTS["webxr"]
    points = from_keypoints(1000 * POINTS["right"], layout)
    points[GAP] = np.nan
    header = ["time", *(f"{name}_{axis}" for name in layout.joints for axis in "xyz")]
    rows = [[k / FPS, *row] for k, row in enumerate(points.reshape(30, -1).tolist())]
    lines = ["# unit: mm", "# side: right", ",".join(header)]
    lines += [",".join("" if np.isnan(v) else f"{v:.6f}" for v in row) for row in rows]
    (tmp_path / "hand.csv").write_text("\n".join(lines))
    check(load_keypoints(tmp_path / "hand.csv"))
    both = [f"{side}_{name}_{axis}" for side in POINTS for name in LAYOUTS["mediapipe"].joints for axis in "xyz"]
    values = np.concatenate([POINTS[side].reshape(30, -1) for side in POINTS], axis=1)
    np.savetxt(tmp_path / "both.csv", values, delimiter=",", header=",".join(both), comments="")
    check(load_keypoints(tmp_path / "both.csv", side="left", fps=FPS), "left", gap=False)
    counted = [f"{axis}{k}" for k in range(21) for axis in "xyz"]
    np.savetxt(
        tmp_path / "n.csv", POINTS["right"].reshape(30, -1), delimiter=",", header=",".join(counted), comments=""
    )
    check(load_keypoints(tmp_path / "n.csv", fps=FPS), gap=False)


def test_own_files_survive(tmp_path):
    recording = KeypointRecording(fps=FPS, positions=POINTS["left"], side="left", layout="quest", source="made")
    save_keypoints(recording, tmp_path / "own.npz")
    again = load_keypoint_file(tmp_path / "own.npz")
    np.testing.assert_array_equal(again.positions, recording.positions)
    assert (again.fps, again.side, again.layout, again.source) == (FPS, "left", "quest", "made")
    check(load_keypoints(tmp_path / "own.npz"), "left", gap=False)


@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(["mediapipe", "webxr", "openxr", "arkit", "quest"]), st.integers(0, 1000))
def test_any_layout_and_pose_comes_back_from_json(tmp_path, name, seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(scale=0.1, size=(3, 21, 3))
    frames = [named(LAYOUTS[name], p, str(rng.choice(["list", "xyz", "pose"]))) for p in points]
    found = load_keypoints(write_json(tmp_path / "hand.json", frames, fps=30))
    np.testing.assert_allclose(found.positions, points, atol=1e-9)


def refused(path: Path, **said: object) -> str:
    with pytest.raises(InputError) as caught:
        load_keypoints(path, **said)  # type: ignore[arg-type]
    message = str(caught.value)
    assert "\n" not in message
    assert path.name in message
    return message


def test_bad_files_say_what_is_wrong_in_one_line(tmp_path):
    good = POINTS["right"]
    np.savez(tmp_path / "nan.npz", joints=np.full_like(good, np.nan), fps=FPS)
    assert "all 30 frames are gaps" in refused(tmp_path / "nan.npz")
    np.savez(tmp_path / "count.npz", joints=good[:, :18], fps=FPS)
    assert "18 points per hand" in refused(tmp_path / "count.npz")
    np.savez(tmp_path / "unit.npz", joints=good, fps=FPS, unit="furlong")
    assert "unit is 'furlong'; known: m, cm, mm" in refused(tmp_path / "unit.npz")
    np.savez(tmp_path / "rate.npz", joints=good, fps=30.0)
    assert "recorded at 30 frames per second" in refused(tmp_path / "rate.npz", fps=60.0)
    (tmp_path / "cut.json").write_text('{"frames": [[')
    assert "not a readable .json file" in refused(tmp_path / "cut.json")
    (tmp_path / "other.json").write_text('{"frames": [{"temperature": 3}]}')
    assert "no keypoint file that is known here, but an .json of frames (1 objects with temperature)" in refused(
        tmp_path / "other.json"
    )
    write_json(tmp_path / "ragged.json", [good[0].tolist(), good[1, :20].tolist()], fps=30)
    assert "frame 1 has 20 points where the first has 21" in refused(tmp_path / "ragged.json")
    lacking = [{k: v for k, v in named(LAYOUTS["webxr"], p, "list").items() if k != "thumb-tip"} for p in good]
    write_json(tmp_path / "lacks.json", [{"hand": "right", "joints": frame} for frame in lacking], fps=30)
    assert "lacks thumb-tip" in refused(tmp_path / "lacks.json")
    (tmp_path / "row.csv").write_text(",".join(f"{a}{k}" for k in range(21) for a in "xyz") + "\n1,2,three")
    assert "frame 0 has 3 cells of 63" in refused(tmp_path / "row.csv")
    assert "no such file" in refused(tmp_path / "absent.json")
    assert "a folder" in refused(tmp_path)
    np.savez(tmp_path / "fast.npz", joints=good, fps="fast")
    assert "fps is 'fast', expected frames per second" in refused(tmp_path / "fast.npz")
    np.savez(tmp_path / "two.npz", joints=good, fps=[30.0, 60.0])
    assert "fps is [30.0, 60.0], expected frames per second" in refused(tmp_path / "two.npz")
    header = [f"{a}{k}" for k in range(21) for a in "xyz"]
    cells = ",".join(map(str, good[0].ravel()))
    (tmp_path / "fast.csv").write_text("# fps: fast\n" + ",".join(header) + f"\n{cells}")
    assert "fps is 'fast', expected frames per second" in refused(tmp_path / "fast.csv")
    (tmp_path / "twice.csv").write_text(",".join([*header, "x0"]) + f"\n{cells},0")
    assert "columns repeat: x0" in refused(tmp_path / "twice.csv")
    write_json(tmp_path / "units.json", good.tolist(), fps=30, unit=["mm"])
    assert "unit is ['mm']; known: m, cm, mm" in refused(tmp_path / "units.json")
    write_json(tmp_path / "rate.json", good.tolist(), fps="fast")
    assert "fps is 'fast', expected frames per second" in refused(tmp_path / "rate.json")
    write_json(tmp_path / "clock.json", [{"time": "12:00", "joints": p.tolist()} for p in good])
    assert "a frame's time is '12:00'" in refused(tmp_path / "clock.json")


def test_a_hand_found_again_under_a_new_id_is_one_hand(recordings):
    path = recordings / "leap_motion" / "confidence-37fps.npz"
    assert "holds 2 hands (right_28+right_30+right_31, left_29)" in refused(path)
    assert "has no hand 'right_1'" in refused(path, sequence="right_1")
    assert load_keypoints(path, side="left").side == "left"
    right = load_keypoints(path, side="right")
    assert right.warnings == ("right_28 was lost and found again as right_30, right_31; they are taken as one",)
    with np.load(path) as arrays:
        seen = np.concatenate([arrays[f"right_{k}_frame"] for k in (28, 30, 31)])
        length = arrays["t"][seen.max()] - arrays["t"][seen.min()]
    assert (right.num_frames - 1) / (right.fps or 0) == pytest.approx(length, abs=0.05)


def test_load_motion_passes_on_what_was_asked(recordings):
    motion = load_motion(recordings / "leap_motion" / "grab.npz", side="right")
    assert motion.side == "right"
    assert motion.fps == pytest.approx(115.4, rel=0.01)
    with pytest.raises(InputError, match="said to be a left hand"):
        load_motion(recordings / "leap_motion" / "grab.npz", side="left")

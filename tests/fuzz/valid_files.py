"""One small valid file of every format that the project reads, and how it is read."""

import dataclasses
import json
import pickle
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from mjx_hand.capture.keypoints.layouts import DIGITS, KEYPOINTS
from mjx_hand.capture.keypoints.recording import KeypointRecording, save_keypoints
from mjx_hand.capture.markers.marker_recording import MarkerRecording, save_recording
from mjx_hand.hand.joints import LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.motion import (
    Demonstration,
    JointMotion,
    Motion,
    ObjectDescription,
    save_demonstration,
    save_joint_motion,
    save_motion,
)
from mjx_hand.robots.robot_motion import RobotMotion, save_robot_motion
from tests.capture.datasets import (
    test_arctic,
    test_dexcanvas,
    test_dexcanvas_tables,
    test_dexycb,
    test_grab,
    test_hamer,
    test_hocap,
    test_oakink2,
    test_objects,
    test_taco,
)
from tests.capture.datasets.subjects import licensed_file, licensed_hand
from tests.capture.marker_files.written import NAMES, WRITERS
from tests.hand.mano_layout import official
from train.learning.checkpoint import Checkpoint, save_checkpoint
from train.learning.training_state import save_run
from train.settings.config import Config
from train.settings.saved import policy_settings, settings_of, write_settings

FRAMES = 8
RNG = np.random.default_rng(0)


@dataclasses.dataclass(frozen=True)
class Valid:
    """A valid recording or file.

    Attributes:
        format: what it is called in the table.
        root: folder of all that belongs to it; a mutant is a copy of it with one file changed.
        opened: what is opened, relative to `root`.
        changed: which file of it is changed, relative to `root`.
        readers: names in `readers.READERS`.
        choice: arguments of the readers.
    """

    format: str
    root: Path
    opened: str
    changed: str
    readers: tuple[str, ...]
    choice: Mapping[str, Any] = dataclasses.field(default_factory=dict)


def write_valid(folder: Path) -> list[Valid]:
    """Write all of them below a folder."""
    return [*_own(folder), *_markers(folder), *_keypoints(folder), *_datasets(folder), *_hands(folder), *_runs(folder)]


def _new(folder: Path, name: str) -> Path:
    made = folder / name
    made.mkdir(parents=True)
    return made


def _single(format: str, path: Path, *readers: str, **choice: Any) -> Valid:
    return Valid(format, path.parent, path.name, path.name, readers, choice)


def joint_motion() -> JointMotion:
    """A few frames of a moving hand."""
    return JointMotion(
        fps=30.0,
        angles=RNG.uniform(0, 0.5, (FRAMES, 20)),
        wrist_position=RNG.normal(size=(FRAMES, 3)),
        wrist_quaternion=Rotation.random(FRAMES, rng=RNG).as_quat(scalar_first=True),
        valid=np.ones(FRAMES, bool),
        side="right",
        source="valid",
    )


def _own(folder: Path) -> list[Valid]:
    joints = joint_motion()
    rotations = Rotation.from_rotvec(RNG.normal(scale=0.2, size=(FRAMES * 15, 3))).as_matrix().reshape(FRAMES, 15, 3, 3)
    wrist: dict[str, Any] = {"wrist_position": joints.wrist_position, "wrist_quaternion": joints.wrist_quaternion}
    motion = Motion(
        fps=30.0, rotations=rotations, **wrist, shape=RNG.normal(size=10), valid=np.ones(FRAMES, bool), source="valid"
    )
    pose = np.zeros((FRAMES, 7))
    pose[:, 3] = 1
    held = ObjectDescription(size=np.full(3, 0.02), mass=0.1, friction=1.0, kind="box")
    boxes = np.full((1, 3), 0.03)
    demonstration = Demonstration(
        motion=joints,
        object_pose=pose,
        object=held,
        support=boxes,
        support_position=boxes,
        shape=np.zeros(10),
        grasp="pinch",
    )
    robot = RobotMotion(
        fps=30.0,
        values=RNG.normal(size=(FRAMES, 2)),
        base_position=joints.wrist_position,
        base_quaternion=joints.wrist_quaternion,
        valid=np.ones(FRAMES, bool),
        joint_names=("a", "b"),
    )
    found = []
    kinds: tuple[tuple[str, Any, Any, str], ...] = (
        ("motion NPZ", save_motion, motion, "motion"),
        ("angles NPZ", save_joint_motion, joints, "angles"),
        ("demonstration NPZ", save_demonstration, demonstration, "demonstration"),
        ("robot motion NPZ", save_robot_motion, robot, "robot motion"),
    )
    for name, save, value, reader in kinds:
        path = _new(folder, name) / "a.npz"
        write: Any = save
        write(value, path)
        found.append(_single(name, path, reader, "info"))
    path = _new(folder, "truth NPZ") / "a.truth.npz"
    truth = {"angles": joints.angles, **wrist, "object_pose": pose, "shape": np.zeros(10)}
    np.savez_compressed(path, schema="mjx-hand/truth/1", **truth)
    return [*found, _single("truth NPZ", path, "truth")]


def _markers(folder: Path) -> list[Valid]:
    positions = RNG.uniform(-900, 900, (5, 3, 3)).round(3)
    found = []
    for kind, write in WRITERS.items():
        path = write(_new(folder, f"markers {kind}") / f"a.{kind}", positions)
        found.append(_single(f"markers {kind.upper()}", path, "markers", "info"))
    path = _new(folder, "markers npz") / "a.npz"
    seen = np.ones((5, 3), bool)
    recording = MarkerRecording(fps=120.0, positions=positions / 1000, visible=seen, names=NAMES, source="valid")
    save_recording(recording, path)
    found.append(_single("markers NPZ", path, "markers", "info"))
    path = _new(folder, "marker set") / "set.yaml"
    shutil.copy(Path(__file__).parents[2] / "mjx_hand/capture/markers/hand22.yaml", path)
    return [*found, _single("marker set YAML", path, "marker set")]


def hand_points() -> np.ndarray:
    """(frames, 21, 3): the open hand's keypoints, a little shaken."""
    hand = load_hand()
    rest = np.concatenate([hand.joint_regressor @ hand.template, hand.template[np.asarray(hand.tip_vertices)]])
    order = [0, *(13, 14, 15, 20), *(1, 2, 3, 16), *(4, 5, 6, 17), *(10, 11, 12, 19), *(7, 8, 9, 18)]
    return rest[order] + RNG.normal(scale=1e-4, size=(FRAMES, 21, 3))


def _keypoints(folder: Path) -> list[Valid]:
    points = hand_points()
    frames = [{"t": k / 30, "right": points[k].tolist()} for k in range(FRAMES)]
    path = _new(folder, "keypoint JSON") / "a.json"
    path.write_text(json.dumps({"frames": frames}))
    found = [_single("keypoint JSON", path, "keypoints", "info")]
    path = _new(folder, "MediaPipe JSON") / "a.json"
    landmarks = [[dict(zip("xyz", map(float, p), strict=True)) for p in frame] for frame in points]
    results = [
        {"t": k / 30, "worldLandmarks": [hand], "handedness": [[{"categoryName": "Right", "score": 0.9}]]}
        for k, hand in enumerate(landmarks)
    ]
    path.write_text(json.dumps({"frames": results}))
    found.append(_single("keypoint JSON", path, "keypoints", "info", side="right"))
    path = _new(folder, "keypoint CSV") / "a.csv"
    names = [f"{name}_{axis}" for name in KEYPOINTS for axis in "xyz"]
    rows = [",".join(["t", *names])] + [
        ",".join([f"{k / 30:.4f}", *(f"{v:.5f}" for v in frame.ravel())]) for k, frame in enumerate(points)
    ]
    path.write_text("\n".join(rows) + "\n")
    found.append(_single("keypoint CSV", path, "keypoints", "info", side="right"))
    kinds: tuple[tuple[str, dict[str, Any] | None], ...] = (
        ("own", None),
        ("arrays", {"joints": points, "fps": 30.0, "side": "right", "t": np.arange(FRAMES) / 30}),
        ("leap", _leap(points)),
    )
    for name, arrays in kinds:
        path = _new(folder, f"keypoint npz {name}") / "a.npz"
        if arrays is None:
            save_keypoints(KeypointRecording(fps=30.0, positions=points, side="right"), path)
        else:
            np.savez(path, **arrays)
        found.append(_single("keypoint NPZ", path, "keypoints", "info"))
    return found


def _leap(points: np.ndarray) -> dict[str, Any]:
    joints = 1000 * points[:, 1:].reshape(FRAMES, 5, 4, 3)
    return {"t": np.arange(FRAMES) / 110, "right_1_joints_mm": joints, "right_1_frame": np.arange(FRAMES)}


def _datasets(folder: Path) -> list[Valid]:
    mano = {"mano": str(licensed_file(_new(folder, "mano for datasets")))}
    found = []

    def add(format: str, root: Path, opened: Path, *changed: Path, **choice: Any) -> None:
        for path in changed or (opened,):
            given = (str(opened.relative_to(root)), str(path.relative_to(root)))
            found.append(Valid(format, root, *given, ("motion", "info"), {"mano": mano["mano"], **choice}))

    root = _new(folder, "arctic")
    add("ARCTIC", root, test_arctic.write(root, right=test_arctic.hand_of("right")))
    root = _new(folder, "grab")
    add("GRAB", root, test_grab.write(root))
    root = _new(folder, "oakink2")
    add("OakInk2 pickle", root, test_oakink2.write(root, hands=("rh",)))
    test_objects.mesh(root / "object_raw" / "align_ds" / "O02@0015@00001" / "scan.ply")
    root = _new(folder, "oakink2 arrays")
    add("OakInk2 pickle", root, test_oakink2.write(root, hands=("rh",), tensors=False))
    root = _new(folder, "dexcanvas")
    add("DexCanvas pickle", root, test_dexcanvas.write_row(root, {"right": test_dexcanvas.fields()}))
    for name, options in (("plain", {"compression": "none", "use_dictionary": False}), ("packed", {})):
        root = _new(folder, f"dexcanvas {name}")
        add("DexCanvas Parquet", root, test_dexcanvas_tables.write(root, test_dexcanvas_tables.row("right"), **options))
    root = _new(folder, "taco")
    opened = test_taco.write(root, sides=["right"], objects={"tool_051": test_objects.matrices()})
    test_objects.mesh(root / "Object_Models" / "051_cm.obj", scale=100)
    add("TACO folder", root, opened, *sorted(opened.iterdir()), *sorted(root.rglob("tool_051.npy")))
    for name, contents in (
        ("hamer", [test_hamer.output(k) for k in range(3)]),
        ("wilor", [[test_hamer.mini(k, "right")] for k in range(3)]),
    ):
        root = _new(folder, name)
        (root / "a.pkl").write_bytes(pickle.dumps(contents))
        add("HaMeR and WiLoR", root, root / "a.pkl", fps=30.0)
    root = _new(folder, "dexycb")
    opened = test_dexycb.write(root)
    add("DexYCB folder", root, opened, opened / "meta.yml", opened / "pose.npz", *sorted(root.rglob("mano.yml")))
    root = _new(folder, "hocap")
    opened = test_hocap.write(root, sides=["right"], poses=test_hocap.rows()[:1].repeat(2, axis=0))
    add("HO-Cap folder", root, opened, opened / "meta.yaml", opened / "poses_m.npy", *sorted(root.rglob("subject*.y*")))
    root = _new(folder, "dexmv")
    np.savez(root / "a.npz", **_dexmv())
    add("DexMV", root, root / "a.npz")
    return found


def _dexmv() -> dict[str, Any]:
    """A hand at rest that moves as a whole."""
    hand = load_hand()
    transforms = np.tile(np.eye(4), (FRAMES, 16, 1, 1))
    transforms[..., :3, 3] = hand.joint_regressor @ hand.template + RNG.normal(size=(FRAMES, 1, 3))
    return {"mano": np.zeros((FRAMES, 61)), "joint_transforms": transforms, "joint_transform_order": np.array(LINKS)}


def _hands(folder: Path) -> list[Valid]:
    path = licensed_file(_new(folder, "MANO NPZ"))
    found = [_single("MANO NPZ", path, "mano", "info")]
    path = _new(folder, "MANO pickle") / "MANO_RIGHT.pkl"
    path.write_bytes(official(licensed_hand()))
    found.append(_single("MANO pickle", path, "mano"))
    root = _new(folder, "robot")
    (root / "robot.urdf").write_text(_urdf())
    tips = {f"{finger}_tip": f"{finger}_tip" for finger in DIGITS}
    described = {"palm": "palm", "scaling": 1.0, "fingers": [1.0, 0, 0], "palmar": [0, 0, 1.0], "tips": tips}
    (root / "robot.yaml").write_text(yaml.safe_dump(described, sort_keys=False))
    found.append(Valid("URDF", root, "robot.urdf", "robot.urdf", ("robot", "info")))
    found.append(Valid("robot YAML", root, "robot.urdf", "robot.yaml", ("robot",)))
    return found


def _urdf() -> str:
    rows = ['<robot name="little">', '<link name="palm"/>']
    for k, finger in enumerate(DIGITS):
        rows.append(
            f'<link name="{finger}"/><joint name="{finger}_joint" type="revolute"><origin xyz="0.08 {0.02 * k} 0"/>'
            f'<parent link="palm"/><child link="{finger}"/><axis xyz="0 1 0"/>'
            f'<limit lower="0" upper="1.6" effort="1" velocity="1"/></joint>'
            f'<link name="{finger}_tip"/><joint name="{finger}_end" type="fixed"><origin xyz="0.05 0 0"/>'
            f'<parent link="{finger}"/><child link="{finger}_tip"/></joint>'
        )
    return "\n".join([*rows, "</robot>"])


def _runs(folder: Path) -> list[Valid]:
    config = Config(out=str(folder))
    network = {"params": {"hidden_0": {"kernel": RNG.normal(size=(7, 4)), "bias": np.zeros(4)}}}
    path = _new(folder, "policy NPZ") / "best.npz"
    save_checkpoint(Checkpoint(network, network, 10, 0.5, "pinch", 7, policy_settings(config)), path)
    found = [_single("policy NPZ", path, "policy")]
    root = _new(folder, "state")
    notes = {"points": [], "seconds": 1.0, "settings": settings_of(config)}
    for steps in (1, 2):
        newest = save_run(root / "state", steps, state(steps), json.loads(json.dumps(notes)))
    changed = f"state/{newest.name}"
    found.append(Valid("training state", root, "state", changed, ("state",)))
    root = _new(folder, "settings")
    write_settings(config, root / "config.yaml")
    found.append(_single("run settings YAML", root / "config.yaml", "settings"))
    root = _new(folder, "curve")
    names = "steps,seconds,success,tracking_error_cm,rotation_error_deg"
    (root / "curve.csv").write_text(f"{names}\n0,1.5,0,3.1,20\n4096,9,0.5,1.1,9\n")
    found.append(Valid("curve CSV", root, ".", "curve.csv", ("curve",)))
    root = _new(folder, "ledger")
    row = {"row": {"file": "a.npz", "status": "done", "frames": 3, "fps": 30.0}, "key": "k", "output": [1, 2]}
    (root / ".retarget-ledger.jsonl").write_text(2 * (json.dumps(row) + "\n"))
    found.append(Valid("retarget ledger", root, ".", ".retarget-ledger.jsonl", ("ledger",)))
    return found


def state(value: float) -> dict[str, Any]:
    """The arrays of a training's state, all telling which it is."""
    return {"a": np.full((30, 20), value, np.float32), "key": np.full(2, value, np.uint32), "n": np.array(value, "i4")}


TEMPLATE = jax.eval_shape(lambda: state(0.0))

"""Whatever stands in a field of a recording, reading it gives a sound motion or one clear line."""

import copy
import json
import pickle
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import yaml

from mjx_hand.capture.load import load_motion
from mjx_hand.capture.load_scene import load_scene
from mjx_hand.errors import InputError
from mjx_hand.motion import check_motion
from tests.capture.datasets import (
    test_arctic,
    test_dexcanvas,
    test_dexycb,
    test_hamer,
    test_hocap,
    test_oakink2,
    test_taco,
)
from tests.capture.datasets.subjects import licensed_file

JUNK = (
    *(None, "", "junk", 7, -1, 3.5, float("nan"), True, [], {}, [None], [[1.0], [2.0, 3.0]], {"a": 1}, b"bytes"),
    *(np.zeros(0), np.zeros((6, 1)), np.full(3, np.inf), np.array("text"), np.array([{}], dtype=object), 1j, 10**30),
)


def paths(value: Any, here: tuple = ()) -> Iterator[tuple]:
    """The way to every value in nested dictionaries and lists, the first of each list standing for all."""
    if here:
        yield here
    inside = value.items() if isinstance(value, dict) else list(enumerate(value))[:1] if isinstance(value, list) else ()
    for key, item in inside:
        yield from paths(item, (*here, key))


def spoiled(value: Any, way: tuple, junk: Any) -> Any:
    value = copy.deepcopy(value)
    place = value
    for key in way[:-1]:
        place = place[key]
    place[way[-1]] = junk
    return value


def reads_or_says(path, load=load_motion, **choice) -> None:
    said = ""
    try:
        found = load(path, **choice)
        for hand in found.hands if load is load_scene else (found,):
            check_motion(hand)
    except InputError as error:
        said = str(error)
    assert "\n" not in said
    assert len(said) < 600


CONTENTS = {
    "arctic.npy": {"right": test_arctic.hand_of("right")},
    "grab.npz": {
        "framerate": 120.0,
        "rhand": {
            "params": {"global_orient": np.zeros((6, 3)), "fullpose": np.zeros((6, 45)), "transl": np.zeros((6, 3))},
            "vtemp": "tools/s1_rhand.ply",
        },
    },
    "oakink2.pkl": {
        "raw_mano": {k: test_oakink2.frame(k, ["rh"]) for k in range(6)},
        "mocap_frame_id_list": list(range(6)),
    },
    "dexcanvas.pkl": {
        "hands": [test_dexcanvas.fields()],
        "trajectory_metadata": {"hand_names": ["right"], "mano_hand_shapes": [[0.0] * 10]},
        "data_fps": 100.0,
    },
    "hamer.pkl": [test_hamer.output(k) for k in range(3)],
    "wilor_mini.pkl": [[test_hamer.mini(k, "right")] for k in range(3)],
}


def write(path, contents):
    if path.suffix == ".pkl":
        path.write_bytes(pickle.dumps(contents))
    elif path.suffix == ".npy":
        np.save(path, np.array(contents, dtype=object))
    else:
        members = {name: np.array(value, dtype=object) for name, value in contents.items()}
        np.savez(path, allow_pickle=True, **members)
    return path


@pytest.mark.parametrize("name", CONTENTS)
def test_junk_in_any_field_of_a_pickle(tmp_path, name):
    choice: dict = {"fps": 30.0} if name in ("hamer.pkl", "wilor_mini.pkl") else {}
    if name == "arctic.npy":
        choice["mano"] = licensed_file(tmp_path)
    load_motion(write(tmp_path / name, CONTENTS[name]), **choice)  # sound as it is
    for way in paths(CONTENTS[name]):
        for junk in JUNK:
            reads_or_says(write(tmp_path / name, spoiled(CONTENTS[name], way, junk)), **choice)


@pytest.mark.parametrize("dataset", [test_dexycb, test_hocap])
def test_junk_in_any_field_of_a_folders_settings(tmp_path, dataset):
    options = {} if dataset is test_dexycb else {"sides": ["right"]}
    folder = dataset.write(tmp_path, **options)
    mano = licensed_file(tmp_path)
    load_motion(folder, mano=mano)
    for file in sorted(tmp_path.rglob("*.y*ml")):
        settings = yaml.safe_load(file.read_text())
        for way in paths(settings):
            for junk in JUNK:
                if isinstance(junk, np.ndarray | bytes | complex):
                    continue
                file.write_text(json.dumps(spoiled(settings, way, junk)))
                reads_or_says(folder, mano=mano)
        file.write_text(yaml.safe_dump(settings))


OBJECTS = {
    "oakink2.pkl": CONTENTS["oakink2.pkl"]
    | {"obj_list": ["a", "b"], "obj_transf": {"a": {k: np.eye(4) for k in range(6)}, "b": {2: np.eye(4).tolist()}}},
    "dexcanvas.pkl": CONTENTS["dexcanvas.pkl"]
    | {
        "objects": [{"pos": np.zeros((6, 3)), "rot_aa": np.zeros((6, 3)).tolist()}],
        "trajectory_metadata": {"hand_slots": ["right", "left"], "object_names": ["cube1"], "hand_names": ["right"]},
    },
}


@pytest.mark.parametrize("name", OBJECTS)
def test_junk_in_what_is_said_of_objects(tmp_path, name):
    contents = OBJECTS[name]
    assert load_scene(write(tmp_path / name, contents)).objects
    for way in paths({key: value for key, value in contents.items() if key not in ("raw_mano", "hands")}):
        for junk in JUNK:
            reads_or_says(write(tmp_path / name, spoiled(contents, way, junk)), load_scene)


def test_junk_in_any_field_of_tacos_pickles(tmp_path):
    folder = test_taco.write(tmp_path, sides=["right"], tensors=False)
    hand, shape = folder / "right_hand.pkl", folder / "right_hand_shape.pkl"
    for file, contents in ((hand, test_taco.frames("right")), (shape, {"hand_shape": np.zeros(10)})):
        for junk in JUNK:
            for spoilt in (
                junk,
                {1: junk},
                {"00001": junk},
                *(spoiled(contents, way, junk) for way in paths(contents)),
            ):
                file.write_bytes(pickle.dumps(spoilt))
                reads_or_says(folder, load_scene)
        file.write_bytes(pickle.dumps(contents))
    assert load_scene(folder).hands

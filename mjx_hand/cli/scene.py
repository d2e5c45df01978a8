"""`mjx-hand scene`: hands and the objects they hold, from any recording, in one file."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro

from mjx_hand.capture.load_scene import load_scene
from mjx_hand.capture.marker_files.load_markers import load_markers
from mjx_hand.capture.object_poses.marker_cluster import track_cluster
from mjx_hand.capture.object_poses.pose_file import PoseTrack, in_frames, load_poses, marker_places
from mjx_hand.cli.facts.scene_facts import scene_facts
from mjx_hand.cli.object_options import Shape, by_name, shape_of
from mjx_hand.errors import InputError
from mjx_hand.motion import RecordedObject, RecordedScene, make_scene, recorded_object, save_scene
from mjx_hand.motion.make_scene import first_poses, up_vector
from mjx_hand.motion.scene import check_scene
from mjx_hand.motion.scene_file import SUFFIXES
from mjx_hand.pytree import replace

Up = Literal["+x", "-x", "+y", "-y", "+z", "-z"]


def scene(
    recording: Annotated[Path, tyro.conf.Positional],
    out: Path,
    object: tuple[str, ...] = (),
    poses: tuple[str, ...] = (),
    object_markers: tuple[str, ...] = (),
    object_places: tuple[str, ...] = (),
    object_unit: Literal["m", "cm", "mm", "in"] = "m",
    marker_file: Path | None = None,
    markers: str | None = None,
    units: str | None = None,
    left: Path | None = None,
    side: Literal["right", "left"] | None = None,
    sequence: str | None = None,
    fps: float | None = None,
    mano: Path | None = None,
    up: Up | None = None,
) -> None:
    """Write a scene as .npz or JSON: hands, objects with their poses, gaps, frame rate and the upward direction.

    Args:
        recording: of any format that is read, of a data set with its objects; or of optical markers, with --markers.
        out: the .npz or .json to write.
        object: of each object that is added, its name and what it looks like: NAME=mesh.stl, NAME=box:0.02,0.03,0.04
            (half extents, m), NAME=sphere:RADIUS, NAME=cylinder:RADIUS,HALF_HEIGHT or NAME=capsule:RADIUS,HALF_LENGTH.
        poses: its poses, NAME=poses.csv (.npy, .npz, .json; docs/scenes.md); without NAME= for the one object.
        object_markers: or the optical markers on it, NAME=a,b,c; without NAME= for the one object.
        object_places: where these markers are in the mesh's frame, NAME=places.yaml (marker: [x, y, z], m); without it
            the object's frame is that of its markers.
        object_unit: of the meshes' numbers.
        marker_file: the marker recording of the objects, where it is not the recording itself.
        markers: the marker set of the hand, where the recording is one of markers: a YAML file, hand22 or glove13.
        units: m, cm, mm or in, where the marker file's own unit is wrong or missing.
        left: a second recording, of the other hand, which begins with the first.
        side: the one hand to read, where the recording holds both.
        sequence: the name of one recording in the file, where there are several.
        fps: frames per second, where the recording does not say.
        mano: a licensed MANO file, or the folder of both, for data sets whose poses need one.
        up: the recording's upward axis, where the recording does not say.
    """
    _check_out(out, recording, left)
    found = load_scene(recording, side=side, sequence=sequence, mano=mano, fps=fps, markers=markers)
    said: list[str] = []
    if left is not None:
        found = _with_hand(found, load_scene(left, fps=fps, mano=mano, markers=markers))
    shapes = by_name("--object", object, None)
    names = list(dict.fromkeys([*shapes, *_named(poses), *_named(object_markers)]))
    one = names[0] if len(names) == 1 else None
    tracks, clusters = by_name("--poses", poses, one), by_name("--object-markers", object_markers, one)
    places = by_name("--object-places", object_places, one)
    lost = [name for name in (*tracks, *clusters, *places) if name not in names]
    if lost:
        raise InputError(f"{lost[0]}: is no object here; name it with --object {lost[0]}=mesh.stl")
    for name in names:
        shape = shape_of(name, shapes.get(name), object_unit)
        if (name in tracks) == (name in clusters):
            raise InputError(f"object {name!r}: give its --poses {name}=FILE or its --object-markers {name}=a,b,c")
        if name in tracks:
            added = _posed(name, load_poses(tracks[name]), shape, found)
        else:
            file = places.get(name)
            added, line = _marked(name, clusters[name], file, marker_file or recording, units, shape, found)
            said.append(line)
        found = replace(found, objects=(*found.objects, added))
    if up is not None:
        found = replace(found, up=up_vector(up))
    found = check_scene(found, str(recording))
    save_scene(found, out)
    for line in said:
        print(line)
    facts = scene_facts(found)
    width = max(len(label) for label, _ in facts)
    for label, text in facts:
        print(f"  {label:<{width}}  {text}")
    print(f"{out}  look at it with: mjx-hand view {out}")


def _check_out(out: Path, *inputs: Path | None) -> None:
    if out.is_dir() or out.suffix.lower() not in SUFFIXES:
        raise InputError(f"{out}: --out is the scene to write, an .npz or .json file")
    for path in inputs:
        if path is not None and out.exists() and path.exists() and out.samefile(path):
            raise InputError(f"{out}: is what is read; give another --out, so that the recording is kept")


def _named(options: tuple[str, ...]) -> list[str]:
    return [option.split("=", 1)[0] for option in options if "=" in option]


def _with_hand(scene: RecordedScene, other: RecordedScene) -> RecordedScene:
    """The scene with the other recording's hand in it."""
    made = make_scene((*scene.hands, *other.hands), up=scene.up, source=scene.source)
    objects = tuple(first_poses(each, made.num_frames) for each in scene.objects)
    return replace(made, objects=objects)


def _posed(name: str, track: PoseTrack, shape: Shape, scene: RecordedScene) -> RecordedObject:
    return in_frames(recorded_object(name, track.poses, **shape), track, scene.fps, scene.num_frames)


def _marked(
    name: str, told: str, places: str | None, file: Path, units: str | None, shape: Shape, scene: RecordedScene
) -> tuple[RecordedObject, str]:
    """The object that wears these markers, and a line on how well they tell its pose."""
    seen = load_markers(file, units)
    labels = [label.strip() for label in told.split(",") if label.strip()]
    at = None if places is None else marker_places(places, labels)
    track = track_cluster(seen, labels, at)
    posed = PoseTrack(track.poses, fps=float(seen.fps))
    added = in_frames(recorded_object(name, track.poses, **shape), posed, scene.fps, scene.num_frames)
    gaps, swaps = int(np.isnan(track.poses).any(axis=1).sum()), np.flatnonzero(track.swapped)
    line = f"{name}: {len(labels)} markers, {1e3 * track.misfit:.2f} mm RMS from one rigid cluster"
    if gaps:
        line += f"; not seen in {gaps} frames"
    if len(swaps):
        line += f"; labels had changed places in {len(swaps)} frames, first {swaps[0]}, and were put right"
    if at is None and shape.get("mesh") is not None:
        line += "; its mesh is taken to lie in the markers' own frame: give --object-places where it does not"
    return added, line

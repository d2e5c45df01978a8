"""Demonstration sets are made once, by simulated capture or from a recording; `load_set` reads them.

A set is a folder of `train/NNN.npz` and `heldout/NNN.npz` (schema mjx-hand/demonstration/2). Beside each stand the
motion that was fitted to its markers, `NNN.motion.npz` (which `mjx-hand retarget` reads), and its truth,
`NNN.truth.npz`; `yield.json` counts what came of all attempts. Training and held-out demonstrations come from different
people, object sizes and seeds. A set made from real recordings holds variations of them, a page for
each, and neither motions nor truth; a streamed one neither of these.
"""

import dataclasses
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from envs.demonstrations.load_set import PARTS, SEALED, demonstration_files
from envs.demonstrations.recordings.recorded_set import recorded_set
from envs.demonstrations.recordings.recording_page import write_pages
from envs.demonstrations.recordings.variations import divided
from envs.demonstrations.scripted.own_object import own_object
from envs.demonstrations.scripted.simulated_capture import load_truth, project_recording, record_trials, save_truth
from envs.demonstrations.scripted.trials import perform_trials
from envs.demonstrations.set_settings import SetSettings, sealed_folder, seed_of_sealed, set_folder
from envs.demonstrations.streamed_hand import streamed_demonstration
from envs.grasps import grasp_type
from envs.grip_force import RECORDED
from mjx_hand.files.digests import json_digest
from mjx_hand.files.npz_archive import replacing
from mjx_hand.files.working_folder import remove_abandoned, working_folder
from mjx_hand.hand.load import load_hand
from mjx_hand.motion.demonstration import load_demonstration, save_demonstration
from mjx_hand.motion.mirror import mirrored_demonstration, mirrored_motion, mirrored_pose
from mjx_hand.motion.motion import load_motion_file, save_motion
from mjx_hand.progress import shares
from mjx_hand.pytree import replace
from mjx_hand.retarget.hands import KinematicHands
from mjx_hand.rigid.build import build_rigid_hand

YIELD = "yield.json"
AS_RECORDED, VARIED = "as recorded", "varied"  # what a set from a recording counts
_APART = 1_000_003  # between the seeds of the parts
_SHAPE_LIMIT = 2.0  # standard deviations

Yields = Mapping[str, Mapping[str, int]]  # what came of the attempts of each part
Report = Callable[[str, float], None]  # what is being done, and the share of it done


def make_missing_sets(settings: SetSettings, root: str | Path, *, sealed: bool = False) -> None:
    """Make those sets, or sealed parts, that the settings stand for and that are not below `root`, and say so.

    Raises:
        InputError: as `make_set` or `make_sealed`.
    """
    for single in settings.expand_types():
        folder = sealed_folder(single, root) if sealed else set_folder(single, root)
        if not folder.is_dir():
            print(f"{folder} is missing: making the demonstrations", flush=True)
            with shares() as report:
                (make_sealed if sealed else make_set)(single, root, report)


def make_set(settings: SetSettings, root: str | Path, report: Report = lambda what, share: None) -> Path:
    """The folder of the set, made if it is not there. It appears whole or not at all.

    Raises:
        InputError: the folder cannot be written, or the grasp fails too often.
    """

    def fill(temporary: Path) -> Yields:
        if settings.grasp == RECORDED:
            return _make_variations(settings, temporary, report)
        if settings.streamed:
            recorded = make_set(dataclasses.replace(settings, streamed=False), root, report)
            return _stream(recorded, settings, temporary, PARTS, report)
        if settings.side == "left":
            right = dataclasses.replace(settings, side="right")
            return _mirror(make_set(right, root, report), temporary, PARTS)
        if (usual := dataclasses.replace(settings, capture=settings.capture.projected_as_usual())) != settings:
            return _project_again(settings, make_set(usual, root, report), temporary, report)
        counts = (settings.people, settings.trials), (settings.heldout_people, settings.heldout_trials)
        return {
            part: _make_part(settings, count, settings.seed + offset * _APART, temporary / part, part, report)
            for offset, (part, count) in enumerate(zip(PARTS, counts, strict=True))
        }

    return _made(set_folder(settings, root), settings, fill)


def make_sealed(settings: SetSettings, root: str | Path, report: Report = lambda what, share: None) -> Path:
    """The folder of the sealed part of a set, `sealed/NNN.npz`, made if it is not there; whole or not at all.

    Raises:
        InputError: as `sealed_folder`, the folder cannot be written, or the grasp fails too often.
    """

    def fill(temporary: Path) -> Yields:
        if settings.streamed:
            recorded = make_sealed(dataclasses.replace(settings, streamed=False), root, report)
            return _stream(recorded, settings, temporary, [SEALED], report)
        if settings.side == "left":
            right = make_sealed(dataclasses.replace(settings, side="right"), root, report)
            return _mirror(right, temporary, [SEALED])
        count, seed = (settings.sealed_people, settings.sealed_trials), seed_of_sealed(settings)
        return {SEALED: _make_part(settings, count, seed, temporary / SEALED, SEALED, report)}

    return _made(sealed_folder(settings, root), settings, fill)


def _made(folder: Path, settings: SetSettings, fill: Callable[[Path], Yields]) -> Path:
    """The folder, filled if it is not there, with what came of all attempts and the settings."""
    if folder.is_dir():
        remove_abandoned(folder)
        return folder
    with working_folder(folder) as temporary:
        for name, told in ((YIELD, fill(temporary)), ("settings.json", dataclasses.asdict(settings))):
            with replacing(temporary / name) as file:
                file.write_text(json.dumps(told, indent=1))
        temporary.chmod(0o755)
        try:
            temporary.rename(folder)
        except OSError:
            if not folder.is_dir():  # another process may have made the same set meanwhile: then its is as good
                raise
    return folder


def _make_part(
    settings: SetSettings, count: tuple[int, int], seed: int, folder: Path, part: str, report: Report
) -> Mapping[str, int]:
    """Make one part, of so many people with so many trials each; what came of its attempts."""
    people, each = count
    model = load_hand()
    grasp = grasp_type(settings.grasp)
    rng = np.random.default_rng(seed)
    shapes = np.clip(rng.normal(size=(people, model.num_shape)), -_SHAPE_LIMIT, _SHAPE_LIMIT)
    hands = [build_rigid_hand(model, shape) for shape in shapes]
    given = {"mass": settings.object_mass, "density": settings.object_density}
    own = own_object(settings.object, grasp, **given) if settings.object else None
    wanted, what = people * each, f"{part} {grasp.name}"
    trials, tally = perform_trials(
        grasp,
        hands,
        each,
        seed,
        lambda kept, tried: report(f"performing {what} grasps", kept / wanted),
        own,
    )
    recorded = record_trials(
        trials,
        hands,
        shapes,
        model,
        grasp,
        seed,
        settings.capture,
        progress=lambda share: report(f"fitting {what} recordings", share),
    )
    folder.mkdir()
    for k, (motion, demonstration, truth) in enumerate(recorded):
        save_motion(motion, folder / f"{k:03d}.motion.npz")
        save_demonstration(demonstration, folder / f"{k:03d}.npz")
        save_truth(truth, folder / f"{k:03d}.truth.npz")
    return tally


def _project_again(settings: SetSettings, usual: Path, folder: Path, report: Report) -> Yields:
    """Make both parts from the fitted motions of a set, with another projection; what came of that set's attempts."""
    hands, what = KinematicHands(axes=settings.capture.axes), f"projecting {settings.grasp} recordings"
    paths = [path for part in PARTS for path in demonstration_files(usual, part)]
    for k, path in enumerate(paths):
        report(what, k / len(paths))
        demonstration, motion = load_demonstration(path), load_motion_file(path.with_suffix(".motion.npz"))
        joints, hinges = project_recording(motion, settings.capture, hands)
        there = folder / path.parent.name
        there.mkdir(exist_ok=True)
        for kept in (".motion.npz", ".truth.npz"):
            shutil.copyfile(path.with_suffix(kept), there / (path.stem + kept))
        save_demonstration(replace(demonstration, motion=joints, **hinges), there / path.name)
    return json.loads((usual / YIELD).read_text())


def _mirror(right: Path, folder: Path, parts: Sequence[str]) -> Yields:
    """Make parts as mirror images of a set's, with their motions and truths; what came of that set's attempts."""
    for path in (path for part in parts for path in demonstration_files(right, part)):
        there = folder / path.parent.name
        there.mkdir(exist_ok=True)
        save_demonstration(mirrored_demonstration(load_demonstration(path)), there / path.name)
        save_motion(
            mirrored_motion(load_motion_file(path.with_suffix(".motion.npz"))), there / f"{path.stem}.motion.npz"
        )
        truth = load_truth(path.with_suffix(".truth.npz"))
        wrist = mirrored_pose(np.concatenate([truth.wrist_position, truth.wrist_quaternion], axis=1))
        mirrored = dataclasses.replace(
            truth,
            wrist_position=wrist[:, :3],
            wrist_quaternion=wrist[:, 3:],
            object_pose=mirrored_pose(truth.object_pose),
        )
        save_truth(mirrored, there / f"{path.stem}.truth.npz")
    return json.loads((right / YIELD).read_text())


def _stream(recorded: Path, settings: SetSettings, folder: Path, parts: Sequence[str], report: Report) -> Yields:
    """Make parts from a set's, with what a live tracker made of each hand; what came of that set's attempts."""
    paths = [path for part in parts for path in demonstration_files(recorded, part)]
    for k, path in enumerate(paths):
        report(f"streaming {settings.grasp} recordings", k / len(paths))
        there = folder / path.parent.name
        there.mkdir(exist_ok=True)
        # Every demonstration of every part and type is seen by a tracker of its own.
        drawn = [settings.grasp, settings.seed, settings.sealed_seed * (SEALED in parts), path.parent.name, path.stem]
        streamed = streamed_demonstration(load_demonstration(path), seed=int(json_digest(drawn)[:8], 16))
        save_demonstration(streamed, there / path.name)
    return json.loads((recorded / YIELD).read_text())


def _make_variations(settings: SetSettings, folder: Path, report: Report) -> Yields:
    """Make both parts from recordings, and a page for each of these; what the parts hold."""
    given = settings.recording
    recorded = recorded_set(given, report)
    yields = {}
    for offset, part in enumerate(PARTS):
        rng = np.random.default_rng(settings.seed + offset * _APART)
        (folder / part).mkdir()
        made = divided(recorded.demonstrations, given, part == PARTS[1], rng)
        for k, demonstration in enumerate(made):
            save_demonstration(demonstration, folder / part / f"{k:03d}.npz")
            report("varying the recordings", k / len(made))
        plain = sum(any(d is one for one in recorded.demonstrations) for d in made)
        yields[part] = {AS_RECORDED: plain, VARIED: len(made) - plain}
    write_pages(recorded, given, folder)
    return yields

"""`export_policy`: a policy, its contract and some demonstrations, in a folder that other programs read."""

import contextlib
import dataclasses
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from envs.observation import observed_features
from envs.tracking import TrackingEnv
from mjx_hand.bodies.named_body import named_body
from mjx_hand.errors import InputError
from mjx_hand.player.exported_policy import ExportedPolicy, save_exported_policy
from mjx_hand.rigid.export.mesh_folder import MESHES, filling
from train.experiment.bundled_policies import bundled_env, with_policy
from train.experiment.setup import chosen_checkpoint, chosen_path, load_env
from train.export.c_source import save_c
from train.export.contract import make_contract
from train.export.contract_page import contract_page
from train.export.demonstrations import FOLDER, save_demonstrations
from train.export.network import difference_from_brax, exported_policy
from train.export.onnx_file import check_onnx, save_onnx
from train.learning.checkpoint import load_checkpoint
from train.settings.config import Config

_USUAL = 3  # demonstrations of a run
_FILES = {"onnx": ("policy.onnx",), "npz": ("policy.npz",), "c": ("policy.c", "policy.h")}
_CONTRACT = "contract.json"


def export_policy(config: Config) -> Path:
    """Write the policy as `export.to` asks, `contract.json`, `contract.md` and `demonstrations/`; the folder.

    Forms of the same policy that the folder already has stay; what it has of another goes.

    Raises:
        InputError: no policy, one of another task, or a folder that cannot be written.
    """
    if "onnx" in config.export.to:
        check_onnx()
    config, included = with_policy(config)
    load_checkpoint(chosen_path(config))  # before anything is made for it
    body = named_body(config.hand)
    size = sum(feature.size for feature in observed_features(config.task, body.names, body.reach))
    checkpoint = chosen_checkpoint(config, size, body.num_targets)
    bare = exported_policy(checkpoint.policy, config.task, body)
    difference = difference_from_brax(bare, checkpoint.policy, config.ppo)
    if config.task.live and config.export.demonstrations:
        raise InputError("export.demonstrations: a policy of teleoperated hands follows no demonstration; leave it out")
    env = None if config.task.live or config.export.demonstrations == 0 else _env(config, included)
    folder = Path(config.export.folder or Path(config.out) / "export")
    with filling(folder) as temporary:
        told = [] if env is None else save_demonstrations(env, _count(config, env), temporary)
        policy = dataclasses.replace(
            bare, contract=make_contract(bare, checkpoint, config.task, body, difference, told, _side(config))
        )
        _save(policy, config.export.to, temporary)
        (temporary / _CONTRACT).write_text(json.dumps(policy.contract, indent=1) + "\n")
        (temporary / "contract.md").write_text(contract_page(policy.contract))
        same = _digest(folder) == policy.digest
    _remove_old(folder, policy.contract, config.export.to if not same else _FILES)
    return folder


def _side(config: Config) -> str | None:
    """Of the hands that a policy was trained on, where its settings tell."""
    data = config.data
    return None if data.folder else (data.recording.side or None) if data.recording.path else data.side


def _env(config: Config, included: bool) -> TrackingEnv:
    """Over the demonstrations to write, on the engine that a player is to agree with."""
    config = dataclasses.replace(config, engine="native")
    beside = included and config.export.demonstrations is None
    return bundled_env(config) if beside else load_env(config, "heldout")


def _count(config: Config, env: TrackingEnv) -> range:
    asked = config.export.demonstrations
    return range(min(env.num_demonstrations, _USUAL if asked is None else asked))


def _save(policy: ExportedPolicy, forms: Collection[str], folder: Path) -> None:
    if "npz" in forms:
        save_exported_policy(policy, folder / "policy.npz")
    if "onnx" in forms:
        save_onnx(policy, folder / "policy.onnx")
    if "c" in forms:
        save_c(policy, folder)


def _digest(folder: Path) -> str:
    """Of the policy that a folder already holds; empty where there is none."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        return json.loads((folder / _CONTRACT).read_text())["policy"]["digest"]
    return ""


def _remove_old(folder: Path, contract: Mapping[str, Any], forms: Collection[str]) -> None:
    """Delete what an earlier export left: other forms, and demonstrations that this contract does not tell of."""
    kept = {file for d in contract["demonstrations"] for file in (d["reference"], d["scene"], *d["meshes"])}
    old = [folder / file for form, files in _FILES.items() if form not in forms for file in files]
    old += [
        path
        for pattern in ("[0-9][0-9][0-9].npz", "[0-9][0-9][0-9].xml", f"{MESHES}/*.obj")
        for path in (folder / FOLDER).glob(pattern)
        if path.relative_to(folder).as_posix() not in kept
    ]
    for path in old:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise InputError(f"cannot delete {path}, which is of another export: {error.strerror}; delete it") from None

"""The contract in Markdown, for people."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any


def contract_page(contract: Mapping[str, Any]) -> str:
    """The page, from what `contract.json` holds."""
    policy, rate, function = contract["policy"], contract["rate"], contract["function"]
    size = sum(entry["size"] for entry in contract["inputs"])
    parts = [
        f"# Policy `{policy['experiment']}`, hand `{contract['body']['name']}`",
        f"{policy['steps']:,} control steps of training; layers {policy['layers']}, {policy['activation']}; "
        f"{policy['precision']}. Digest `{policy['digest']}`.",
        f"A control step is {1000 / rate['control_hz']:g} ms: {rate['substeps']} physics steps of "
        f"{1000 * rate['physics_step_s']:g} ms.",
        "## One step",
        _code(f"{name:8} = {function[name]}" for name in ("scaled", "action", "residual", "command")),
        f"limit = {function['limit']:g}, smoothing = {function['smoothing']:g}, residual_scale as in `contract.json`; "
        f"the residual stands among the features from {function['residual_start']} on. {function['not_finite']}.",
        f"## Inputs: {size} features, in physical units",
        _table(
            ("from", "size", "name", "unit", "frame", "offset", "scale", "meaning", "order"),
            (_input(entry) for entry in contract["inputs"]),
        ),
        "## Outputs",
        _table(
            ("name", "size", "unit", "frame", "order"),
            (
                (e["name"], e["size"], _shortened(e["unit"]), e["frame"], ", ".join(e["elements"]))
                for e in contract["outputs"]
            ),
        ),
        "## Conventions",
        _list(contract["conventions"]),
        "## Body",
        _table(
            ("actuator", "unit", "stiffness", "damping", "force limit"),
            (
                (a["name"], a["unit"], f"{a['stiffness']:g}", f"{a['damping']:.4g}", a["force_limit"] or "–")
                for a in contract["body"]["actuators"]
            ),
        ),
        _list(
            {
                "fingers": ", ".join(contract["body"]["fingers"]),
                **{name: contract["body"][name] for name in ("units", "wrist", "limits")},
                **{c["joint"]: f"{c['slope']:g} * {c['leader']} + {c['shift']:g}" for c in contract["body"]["coupled"]},
            }
        ),
        f"## Demonstrations: `{contract['demonstration_format']['schema']}`",
        _table(
            ("array", "shape", "unit", "frame", "meaning"),
            (
                (name, tuple(e["shape"]), e["unit"], e["frame"], e["meaning"])
                for name, e in contract["demonstration_format"]["arrays"].items()
            ),
        ),
        f"`scene`: {contract['demonstration_format']['scene']}. Digest: {contract['demonstration_format']['digest']}.",
        _table(
            ("reference", "frames", "hand", "grasp", "object", "digest"),
            (
                (d["reference"], d["frames"], d["hand"], d["grasp"], d["object"], d["digest"])
                for d in contract["demonstrations"]
            ),
        ),
        "## Versions",
        _list(contract["versions"]),
        f"Actions differ from those of {contract['parity']['with']} by at most "
        f"{contract['parity']['largest_difference']:.1e} on {contract['parity']['inputs']:,} random inputs.",
    ]
    return "\n\n".join(parts) + "\n"


def _input(entry: Mapping[str, Any]) -> tuple[Any, ...]:
    numbers = (_shortened([f"{value:.6g}" for value in entry[name]]) for name in ("offset", "scale"))
    order = ", ".join(entry["elements"])
    return (
        entry["start"],
        entry["size"],
        entry["name"],
        _shortened(entry["unit"]),
        entry["frame"],
        *numbers,
        entry["meaning"],
        order,
    )


def _shortened(values: str | Sequence[str]) -> str:
    """One value that all share, or all of them."""
    if isinstance(values, str):
        return values
    different = list(dict.fromkeys(values))
    return different[0] if len(different) == 1 else ", ".join(values)


def _table(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def _list(values: Mapping[str, Any]) -> str:
    return "\n".join(f"- {name}: {value}" for name, value in values.items())


def _code(lines: Iterable[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)

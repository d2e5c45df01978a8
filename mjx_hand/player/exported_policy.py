"""`ExportedPolicy`: a policy with its scaling and its filter, as one function of features in physical units."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from mjx_hand.errors import InputError
from mjx_hand.files.checked_arrays import numbers, text
from mjx_hand.files.digests import digest
from mjx_hand.files.npz_archive import load_arrays, save_arrays

SCHEMA = "mjx-hand/exported-policy/1"


@dataclasses.dataclass(frozen=True)
class Layer:
    """y = x kernel + bias."""

    kernel: Float[np.ndarray, "i o"]
    bias: Float[np.ndarray, "o"]


@dataclasses.dataclass(frozen=True)
class ExportedPolicy:
    """A policy for one control step, in single precision.

        x = clip((features - offset) * scale, -limit, limit)
        x = swish(x kernel + bias) for each layer but the last, which is linear
        action = clip(x, -1, 1)
        residual = smoothing * features[residual] + (1 - smoothing) * residual_scale * action

    Attributes:
        offset, scale: of each feature, in its unit and in one over it.
        limit: of scaled features.
        layers: of the network.
        residual_start: where the last step's residual stands among the features.
        residual_scale: what an action of 1 is worth (m, rad).
        smoothing: of the residual's filter.
        contract: every input and output, and what the policy is for; as `contract.json` has it.
    """

    offset: Float[np.ndarray, "n"]
    scale: Float[np.ndarray, "n"]
    limit: float
    layers: tuple[Layer, ...]
    residual_start: int
    residual_scale: Float[np.ndarray, "a"]
    smoothing: float
    contract: Mapping[str, Any]

    @property
    def residual_place(self) -> slice:
        """Of the residual among the features."""
        return slice(self.residual_start, self.residual_start + self.residual_scale.size)

    def step(self, features: Float[np.ndarray, "*b n"]) -> tuple[Float[np.ndarray, "*b a"], Float[np.ndarray, "*b a"]]:
        """One control step: action (-1 to 1) and filtered residual (m, rad).

        Args:
            features: in physical units, in the contract's order.

        Raises:
            InputError: another number of features, or one that is not finite.
        """
        features = np.asarray(features, np.float32)
        if features.shape[-1:] != self.offset.shape:
            raise InputError(
                f"features have shape {features.shape}, this policy reads {self.offset.size}; its contract lists them"
            )
        if not np.isfinite(features).all():
            which = int(np.argwhere(~np.isfinite(features))[0][-1])
            raise InputError(f"feature {which} is NaN or infinite; stop the hand, or give what is known of it")
        x = np.clip((features - self.offset) * self.scale, -self.limit, self.limit)
        *hidden, last = self.layers
        with np.errstate(over="ignore"):  # of exp(-x), whose inverse is then zero, as it has to be
            for layer in hidden:
                x = x @ layer.kernel + layer.bias
                x = x / (np.float32(1) + np.exp(-x))
        action = np.clip(x @ last.kernel + last.bias, np.float32(-1), np.float32(1))
        before = features[..., self.residual_place]
        return action, np.float32(self.smoothing) * before + np.float32(
            1 - self.smoothing
        ) * self.residual_scale * action

    @property
    def digest(self) -> str:
        """SHA-256 of everything that the function computes with."""
        return digest(
            piece
            for name, value in _arrays(self).items()
            for piece in (f"{name} {value.dtype.str} {value.shape}".encode(), value.tobytes())
        )


def save_exported_policy(policy: ExportedPolicy, path: str | Path) -> None:
    """Write as `.npz` (schema mjx-hand/exported-policy/1), its contract in it as JSON."""
    arrays = {**_arrays(policy), "digest": policy.digest, "contract": json.dumps(policy.contract)}
    save_arrays(path, SCHEMA, arrays)


def load_exported_policy(path: str | Path) -> ExportedPolicy:
    """Read what `save_exported_policy` wrote. JAX is not imported.

    Raises:
        InputError: not such a file, or a damaged one.
    """
    arrays = load_arrays(path, SCHEMA)
    layers = sum(name.startswith("kernel") for name in arrays)
    sizes = ["n", *(f"h{k}" for k in range(1, layers)), "a"]
    layout: dict[str, tuple[str, ...]] = {f"kernel{k}": (sizes[k], sizes[k + 1]) for k in range(layers)}
    layout |= {f"bias{k}": (sizes[k + 1],) for k in range(layers)}
    layout |= {"offset": ("n",), "scale": ("n",), "residual_scale": ("a",)}
    found = numbers(path, arrays, {**layout, "limit": (), "residual_start": (), "smoothing": ()})
    try:
        contract = json.loads(text(path, arrays, "contract"))
    except ValueError as error:
        raise InputError(f"{path}: its contract cannot be read ({error}); export the policy again") from None
    policy = ExportedPolicy(
        offset=_single(found["offset"]),
        scale=_single(found["scale"]),
        limit=float(found["limit"]),
        layers=tuple(Layer(_single(found[f"kernel{k}"]), _single(found[f"bias{k}"])) for k in range(layers)),
        residual_start=int(found["residual_start"]),
        residual_scale=_single(found["residual_scale"]),
        smoothing=float(found["smoothing"]),
        contract=contract,
    )
    if not layers or text(path, arrays, "digest") != policy.digest:
        raise InputError(f"{path}: its contents do not match its digest; export the policy again")
    return policy


def _single(values: Sequence[float] | np.ndarray) -> np.ndarray:
    return np.asarray(values, np.float32)


def _arrays(policy: ExportedPolicy) -> dict[str, Any]:
    layers = {
        f"{name}{k}": getattr(layer, name) for k, layer in enumerate(policy.layers) for name in ("kernel", "bias")
    }
    return {
        **layers,
        **{name: _single(getattr(policy, name)) for name in ("offset", "scale", "residual_scale")},
        "limit": np.float64(policy.limit),
        "smoothing": np.float64(policy.smoothing),
        "residual_start": np.int64(policy.residual_start),
    }

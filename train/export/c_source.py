"""An exported policy as a C99 file that needs `expf` alone."""

from pathlib import Path

import numpy as np

from mjx_hand.player.exported_policy import ExportedPolicy, Layer

_HEADER = """\
/* One control step of a policy that mjx-hand exported; contract.json says what every number is.
   experiment {experiment}, digest {digest} */
#ifndef POLICY_H
#define POLICY_H

#define POLICY_FEATURES {features}
#define POLICY_ACTIONS {actions}
#define POLICY_DIGEST "{digest}"

#ifdef __cplusplus
extern "C" {{
#endif

/* features: in physical units (m, rad, s, kg), the last step's residual among them.
   action: -1 to 1. residual: m, rad; what to add to the reference's controls.
   Returns 0; or, where a feature is NaN or infinite, 1 + its number, and leaves action and residual as they are.
   Keeps nothing from call to call, and needs no memory but the stack. */
int policy_step(const float features[POLICY_FEATURES], float action[POLICY_ACTIONS], float residual[POLICY_ACTIONS]);

#ifdef __cplusplus
}}
#endif

#endif
"""

_SOURCE = """\
/* Build: cc -O2 -c policy.c; link with -lm. */
#include "policy.h"

#include <math.h>

{arrays}
static float clip(float value, float low, float high) {{
    return value < low ? low : value > high ? high : value;
}}

/* y = x kernel + bias; row by row, so that a compiler can do several sums at once. */
static void layer(const float *x, int inputs, const float *kernel, const float *bias, int outputs, float *y) {{
    for (int j = 0; j < outputs; ++j) y[j] = bias[j];
    for (int i = 0; i < inputs; ++i) {{
        const float value = x[i];
        const float *row = kernel + (long)i * outputs;
        for (int j = 0; j < outputs; ++j) y[j] += value * row[j];
    }}
}}

int policy_step(const float features[POLICY_FEATURES], float action[POLICY_ACTIONS], float residual[POLICY_ACTIONS]) {{
    float x[{widest}], y[{widest}];
    for (int i = 0; i < POLICY_FEATURES; ++i) {{
        if (!isfinite(features[i])) return i + 1;
        x[i] = clip((features[i] - offset[i]) * scale[i], -{limit}, {limit});
    }}
{hidden}    layer(x, {last_inputs}, kernel{last}, bias{last}, POLICY_ACTIONS, y);
    for (int i = 0; i < POLICY_ACTIONS; ++i) {{
        action[i] = clip(y[i], -1.0f, 1.0f);
        residual[i] = {smoothing} * features[{residual_start} + i] + gain[i] * action[i];
    }}
    return 0;
}}
"""

_HIDDEN = """\
    layer(x, {inputs}, kernel{k}, bias{k}, {outputs}, y);
    for (int i = 0; i < {outputs}; ++i) x[i] = y[i] / (1.0f + expf(-y[i]));
"""


def save_c(policy: ExportedPolicy, folder: Path) -> None:
    """Write `policy.c` and `policy.h`."""
    sizes = {"features": policy.offset.size, "actions": policy.residual_scale.size}
    experiment = str(policy.contract.get("policy", {}).get("experiment", "")).replace("*/", "")
    (folder / "policy.h").write_text(_HEADER.format(experiment=experiment, digest=policy.digest, **sizes))
    last = len(policy.layers) - 1
    arrays = {"offset": policy.offset, "scale": policy.scale}
    arrays["gain"] = np.float32(1 - policy.smoothing) * policy.residual_scale
    for k, layer in enumerate(policy.layers):
        arrays |= {f"kernel{k}": layer.kernel, f"bias{k}": layer.bias}
    (folder / "policy.c").write_text(
        _SOURCE.format(
            arrays="\n".join(_array(name, values) for name, values in arrays.items()),
            widest=max(sizes["features"], *(layer.bias.size for layer in policy.layers)),
            limit=_number(policy.limit),
            hidden="".join(_hidden(k, layer) for k, layer in enumerate(policy.layers[:-1])),
            last=last,
            last_inputs=policy.layers[last].kernel.shape[0],
            smoothing=_number(policy.smoothing),
            residual_start=policy.residual_start,
        )
    )


def _hidden(k: int, layer: Layer) -> str:
    inputs, outputs = layer.kernel.shape
    return _HIDDEN.format(k=k, inputs=inputs, outputs=outputs)


def _array(name: str, values: np.ndarray) -> str:
    numbers = [_number(value) for value in values.ravel().tolist()]
    rows = [", ".join(numbers[k : k + 8]) for k in range(0, len(numbers), 8)]
    return f"static const float {name}[{len(numbers)}] = {{\n    " + ",\n    ".join(rows) + "};\n"


def _number(value: float) -> str:
    """With the nine digits that tell single precision's numbers apart."""
    text = f"{value:.9g}"
    return f"{text}f" if any(mark in text for mark in ".en") else f"{text}.0f"

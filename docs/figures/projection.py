"""Draws the two figures of docs/projection.md: `python docs/figures/projection.py`."""

from pathlib import Path

import jax.numpy as jnp
import matplotlib
import numpy as np
from scipy.spatial.transform import Rotation

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from mjx_hand.projection import project_one_dof, project_two_dof
from mjx_hand.projection.paper import bch2_two_dof, naive_two_dof, paper_one_dof, paper_two_dof
from mjx_hand.rotations import axis_angle_matrix, geodesic_angle

HERE = Path(__file__).parent
SAMPLES = 4000
X, Y = jnp.eye(3)[0], jnp.eye(3)[1]
STYLE = {"exact": ("C0", "-"), "paper": ("C3", "-"), "naive": ("k", ":"), "bch2": ("C2", "-")}


def one_dof_errors(off_axis: float, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Errors (degrees) on flexion of 0 to 100 degrees followed by a turn of this size about a random direction."""
    direction = rng.normal(size=(SAMPLES, 3))
    direction *= off_axis / np.linalg.norm(direction, axis=1, keepdims=True)
    flexion = Rotation.from_rotvec(rng.uniform(0, np.radians(100), (SAMPLES, 1)) * np.array([[1.0, 0, 0]]))
    rotation = jnp.asarray((flexion * Rotation.from_rotvec(direction)).as_matrix())
    solvers = {"exact": project_one_dof, "paper": paper_one_dof}
    return {
        name: np.degrees(geodesic_angle(rotation, axis_angle_matrix(X, solve(rotation, X))))
        for name, solve in solvers.items()
    }


def two_dof_errors(largest: float, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Errors (degrees) on exactly reachable rotations with both angles uniform up to this size."""
    first, second = jnp.asarray(rng.uniform(-largest, largest, (2, SAMPLES)))
    rotation = axis_angle_matrix(X, first) @ axis_angle_matrix(Y, second)
    solvers = {"paper": paper_two_dof, "naive": naive_two_dof, "bch2": bch2_two_dof, "exact": project_two_dof}
    errors = {}
    for name, solve in solvers.items():
        found = solve(rotation, X, Y)
        made = axis_angle_matrix(X, found[0]) @ axis_angle_matrix(Y, found[1])
        errors[name] = np.degrees(geodesic_angle(rotation, made))
    return errors


def draw_one_dof() -> None:
    """How far each formula's angle leaves the rotation, against the turn away from the axis."""
    sizes = np.linspace(1, 80, 40)
    errors = [one_dof_errors(np.radians(size), np.random.default_rng(1)) for size in sizes]
    figure, axes = plt.subplots(figsize=(5.2, 3.4), layout="constrained")
    labels = {"exact": "minimiser", "paper": "paper's formula"}
    for name, label in labels.items():
        axes.plot(sizes, [e[name].mean() for e in errors], color=STYLE[name][0], label=f"{label}, mean")
        axes.plot(sizes, [e[name].max() for e in errors], color=STYLE[name][0], ls="--", label=f"{label}, largest")
    axes.set(xlabel="turn off the axis (degrees)", ylabel="error (degrees)", xlim=(0, 80), ylim=(0, None))
    axes.set_title("One hinge, flexion 0 to 100°", fontsize=10)
    axes.legend(frameon=False, fontsize=8)
    axes.grid(alpha=0.3)
    figure.savefig(HERE / "projection_one_dof.png", dpi=110)


def draw_two_dof() -> None:
    """How far each method is from a rotation that the two hinges reach exactly, against the size of the angles."""
    sizes = np.linspace(5, 90, 18)
    errors = [two_dof_errors(np.radians(size), np.random.default_rng(2)) for size in sizes]
    figure, axes = plt.subplots(figsize=(5.2, 3.4), layout="constrained")
    labels = {"paper": "paper's Algorithm 1", "naive": "naive", "bch2": "one order further", "exact": "exact (float32)"}
    for name, label in labels.items():
        colour, line = STYLE[name]
        width = 3 if name == "paper" else 1.5
        axes.semilogy(sizes, [e[name].mean() for e in errors], color=colour, ls=line, lw=width, label=label)
    axes.set(xlabel="both angles uniform up to ± (degrees)", ylabel="mean error (degrees)", xlim=(0, 90))
    axes.set_title("Two orthogonal hinges, rotations they reach exactly", fontsize=10)
    axes.legend(frameon=False, fontsize=8, loc="center right")
    axes.grid(alpha=0.3)
    figure.savefig(HERE / "projection_two_dof.png", dpi=110)


if __name__ == "__main__":
    draw_one_dof()
    draw_two_dof()

"""What the browser viewer shows: layers that move over time, and figures that change over time."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from mjx_hand.errors import InputError

Array = np.ndarray
Colour = tuple[int, int, int]
Mesh = tuple[Array, Array]  # vertices (v, 3), m, and triangles (f, 3): every mesh has its own v and f


@dataclass(frozen=True)
class MeshLayer:
    """Rigid bodies.

    Attributes:
        name: what its checkbox says.
        meshes: each body's surface in its own frame.
        transforms: world from body, for each frame and body (m).
        colour: red, green, blue, 0 to 255.
        opacity: 1 is solid.
        shown: whether it is visible at first.
        edges: whether faces meet in edges, as a box's do, or are one round surface.
    """

    name: str
    meshes: tuple[Mesh, ...]
    transforms: Float[Array, "t n 4 4"]
    colour: Colour
    opacity: float = 1.0
    shown: bool = True
    edges: bool = False


@dataclass(frozen=True)
class SkinLayer:
    """One surface that bends with its bones, by linear blend skinning.

    Attributes:
        name: what its checkbox says.
        mesh: the surface at rest.
        weights: how much each vertex follows each bone.
        rest: the bones' origins at rest (m); their axes are the surface's.
        transforms: world from bone, for each frame and bone (m).
        colour: red, green, blue, 0 to 255.
        opacity: 1 is solid.
        shown: whether it is visible at first.
    """

    name: str
    mesh: Mesh
    weights: Float[Array, "v n"]
    rest: Float[Array, "n 3"]
    transforms: Float[Array, "t n 4 4"]
    colour: Colour
    opacity: float = 1.0
    shown: bool = True


@dataclass(frozen=True)
class PointLayer:
    """Points, such as markers or keypoints, and lines between some of them.

    Attributes:
        name: what its checkbox says.
        points: positions (m); NaN where one is missing.
        colour: red, green, blue, 0 to 255.
        radius: of the balls that stand for them (m).
        lines: pairs of points to join.
        shown: whether it is visible at first.
    """

    name: str
    points: Float[Array, "t n 3"]
    colour: Colour
    radius: float = 0.003
    lines: Int[Array, "k 2"] | None = None
    shown: bool = True


Layer = MeshLayer | SkinLayer | PointLayer


@dataclass(frozen=True)
class Curve:
    """A figure over time.

    Attributes:
        name: what it is.
        values: one a frame; NaN where there is none.
        unit: for people.
    """

    name: str
    values: Float[Array, "t"]
    unit: str


@dataclass(frozen=True)
class Scene:
    """Everything that moves together in one viewer.

    Attributes:
        title: one line.
        fps: frames per second.
        layers: what is drawn.
        curves: what is plotted below.
        up: the world's upward axis.
        ground: height (m, along `up`) of the grid; None puts it below everything.
    """

    title: str
    fps: float
    layers: tuple[Layer, ...]
    curves: tuple[Curve, ...] = ()
    up: str = "+z"
    ground: float | None = None

    @property
    def num_frames(self) -> int:
        return len(_course(self.layers[0]))


def _course(layer: Layer) -> Array:
    return layer.points if isinstance(layer, PointLayer) else layer.transforms


def check_scene(scene: Scene) -> Scene:
    """Return `scene` if it can be shown.

    Raises:
        InputError: it has no layers or frames, they or the curves differ in length, names repeat, nothing is ever seen,
            or the rate is not a positive number.
    """
    if not scene.layers or scene.num_frames == 0:
        raise InputError(f"{scene.title}: nothing to show; give at least one layer of at least one frame")
    lengths = {layer.name: len(_course(layer)) for layer in scene.layers}
    lengths |= {curve.name: len(curve.values) for curve in scene.curves}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise InputError(f"{scene.title}: numbers of frames differ ({counts}); give all the same")
    if len(lengths) < len(scene.layers) + len(scene.curves):
        raise InputError(f"{scene.title}: names repeat among {', '.join(layer.name for layer in scene.layers)}")
    if not (np.isfinite(scene.fps) and scene.fps > 0):
        raise InputError(f"{scene.title}: fps is {scene.fps}, expected a positive number")
    if scene.up not in ("+x", "-x", "+y", "-y", "+z", "-z"):
        raise InputError(f"{scene.title}: up is {scene.up!r}, expected a signed axis such as '+z'")
    if not np.isfinite(positions(scene)).all(axis=-1).any():
        raise InputError(f"{scene.title}: nothing is seen in any frame")
    return scene


def positions(scene: Scene) -> Float[Array, "t n 3"]:
    """Where bodies are (m), or points where there are no bodies; for placing camera and ground. NaN for a missing one.

    Points beside a hand may be a whole person's markers, and would make the hand small.
    """
    bodies = [layer.transforms[..., :3, 3] for layer in scene.layers if not isinstance(layer, PointLayer)]
    points = [layer.points for layer in scene.layers if isinstance(layer, PointLayer)]
    return np.concatenate(bodies or points, axis=1)

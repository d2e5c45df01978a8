"""`HandModel`: a MANO-layout hand as arrays."""

import numpy as np
from jaxtyping import Float, Int

from mjx_hand.pytree import pytree, static

Array = np.ndarray


@pytree
class HandModel:
    """A skinned hand with a linear shape space, in MANO's layout (Romero et al. 2017).

    Lengths are metres. The frame is MANO's right-hand frame: fingers along -x, back of the hand +y
    (palm -y), thumb side +z; a left hand is its mirror image in x (fingers along +x). The wrist
    joint is *not* at the origin. `joints.py` has the joint order.

    Attributes:
        template: rest-pose vertices of the mean shape.
        faces: triangles, outward by the right-hand rule.
        weights: skinning weights, non-negative rows that sum to 1.
        shapedirs: vertex displacement per unit of each shape coefficient.
        posedirs: vertex displacement per entry of (R - I) of the 15 finger rotations, row-major;
            zeros where a hand has no pose correctives.
        joint_regressor: rows that take shaped rest vertices to joint centres.
        tip_vertices: the vertex at each finger tip, in the order of `joints.FINGERS`.
        pose_mean: axis-angle that the recording's pose is relative to (MANO's `hands_mean`); zeros
            for the open hand, whose rest is the flat hand. It is never added silently.
        side: "right" or "left".
        name: where the hand comes from, for reports.
    """

    template: Float[Array, "v 3"]
    faces: Int[Array, "f 3"]
    weights: Float[Array, "v 16"]
    shapedirs: Float[Array, "v 3 s"]
    posedirs: Float[Array, "v 3 135"]
    joint_regressor: Float[Array, "16 v"]
    tip_vertices: Int[Array, "5"]
    pose_mean: Float[Array, "15 3"]
    side: str = static()
    name: str = static()

    @property
    def num_vertices(self) -> int:
        """How many vertices the skin has."""
        return self.template.shape[0]

    @property
    def num_shape(self) -> int:
        """How many shape coefficients the hand takes."""
        return self.shapedirs.shape[-1]

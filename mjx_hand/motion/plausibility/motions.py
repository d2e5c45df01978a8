"""The gate for motions, wherever they come from."""

import numpy as np
from scipy.spatial.transform import Rotation

from mjx_hand.motion.motion import Motion
from mjx_hand.motion.plausibility.finding import Finding, judged
from mjx_hand.motion.plausibility.pace import span_findings, travel_findings
from mjx_hand.motion.plausibility.pose import shape_findings, turn_findings
from mjx_hand.pytree import replace


def plausible_motion(motion: Motion, *findings: Finding, name: str = "") -> Motion:
    """`motion` with a warning for what is doubtful about it: its pace, shape and poses, and what the caller has found.

    Raises:
        InputError: something is beyond doubt no hand's.
    """
    rotations = motion.rotations[motion.valid].reshape(-1, 3, 3)
    vectors = Rotation.from_matrix(rotations).as_rotvec().reshape(-1, 15, 3) if len(rotations) else np.zeros((0, 15, 3))
    found = [
        *findings,
        *span_findings(float(motion.fps), motion.num_frames),
        *travel_findings(motion.wrist_position, motion.valid, float(motion.fps)),
        *shape_findings(np.asarray(motion.shape, float)),
        *turn_findings(vectors, motion.side),
    ]
    return replace(motion, warnings=judged(name or motion.source or "motion", found, motion.warnings))

"""Project a recorded motion onto 20 hinges and see what they could not follow.

    python examples/03_retarget.py [recording.npz]

Without a recording it takes a sample motion. The same from a shell: `mjx-hand retarget recording.npz --out angles.npz`.
"""

import sys
from pathlib import Path

import numpy as np

import mjx_hand
from mjx_hand.capture.simulation.sample_motion import sample_motion
from mjx_hand.hand.joints import LINKS
from mjx_hand.motion import save_joint_motion
from mjx_hand.retarget.sequence import retarget_errors, rigid_hand_of
from mjx_hand.view.figures.plots import joint_errors, save_figure

OUT = Path("outputs/examples/retarget")


def main(recording: str | None = None) -> None:
    """Compare the hinge axes of anatomy with axes fitted to the motion."""
    motion = mjx_hand.load_motion(recording) if recording else sample_motion(mjx_hand.load_hand())
    anatomical = rigid_hand_of(motion, mjx_hand.load_hand(side=motion.side))
    functional = mjx_hand.fit_functional_axes(anatomical, motion.rotations, motion.valid)

    OUT.mkdir(parents=True, exist_ok=True)
    degrees = {}
    for name, rigid in {"anatomical axes": anatomical, "functional axes": functional}.items():
        joint_motion = mjx_hand.retarget_sequence(motion, rigid)  # angles: (frames, 20), rad
        errors = retarget_errors(motion, joint_motion, rigid)
        seen = errors.valid
        degrees[name] = np.rad2deg(errors.rotation[seen])
        tips = 1e3 * errors.tip_position[seen]
        print(f"{name}: rotation {degrees[name].mean():.2f} degrees, finger tips {tips.mean():.1f} mm on average")
        save_joint_motion(joint_motion, OUT / f"{name.split()[0]}.npz")

    save_figure(joint_errors(LINKS[1:], degrees), OUT / "errors.png")
    print(f"{OUT / 'errors.png'}: the error of each joint")


if __name__ == "__main__":
    main(*sys.argv[1:2])

"""`mjx-hand track`: a video of a hand as keypoints, through MediaPipe."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro

from mjx_hand.capture.keypoints.plausible import plausible_keypoints
from mjx_hand.capture.keypoints.recording import save_keypoints
from mjx_hand.capture.keypoints.video import track_video
from mjx_hand.cli.output import check_out, print_warnings
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.progress import counter

FEW = 0.1  # share of the frames below which a hand is taken for a mistake of the tracker


def track(
    video: Annotated[Path, tyro.conf.Positional], out: Path, side: Literal["right", "left"] | None = None
) -> None:
    """Track a hand in a video and write its 21 keypoints.

    Args:
        video: an .mp4, .mov or .avi.
        out: the .npz to write: keypoints, which `mjx-hand keypoints` makes a motion of.
        side: which hand, where both are seen.
    """
    check_out(out, video)
    with counter(None, f"{video.name}: frames") as advance:
        hands = track_video(video, lambda done, total: advance(1))
    seen = {name: float(np.isfinite(hand.positions).all(axis=(1, 2)).mean()) for name, hand in hands.items()}
    often = [name for name, share in seen.items() if share >= FEW] or list(seen)
    if side is None and len(often) > 1:
        shares = ", ".join(f"{name} in {100 * seen[name]:.0f} %" for name in often)
        raise InputError(f"{video}: shows both hands ({shares} of the frames); choose one with --side")
    which = side or often[0]
    if which not in hands:
        raise InputError(f"{video}: shows no {which} hand; it shows {', '.join(hands)}")
    found = plausible_keypoints(hands[which], load_hand(side=which))
    save_keypoints(found, out)
    print(f"{out}: {hands[which].num_frames} frames at {hands[which].fps:g}/s, hand seen in {100 * seen[which]:.0f} %")
    print_warnings(found.warnings)
    print(f"make a motion of it with: mjx-hand keypoints {out} --out motion.npz --cutoff 6")

"""The picture of the README: demonstration above, twin below, at five moments of a held-out pinch.

Run it after `make demo`, which trains the policy: `python docs/figures/twin.py`
"""

from pathlib import Path

import numpy as np
from PIL import Image

from envs.scene import demonstration_spec
from mjx_hand.view.video.video import render_frames
from train.experiment.evaluate_seeds import POLICY, evaluate_checkpoint
from train.settings.config import compose

MOMENTS = (0.05, 0.33, 0.55, 0.75, 0.99)  # shares of the demonstration
SIZE = (600, 600)  # twice what is kept, so that edges are smooth


def main() -> None:
    """Write twin.png beside this file."""
    results = evaluate_checkpoint(compose(["config=pinch_demo"]))
    rollouts, scores = results.rollouts[POLICY], results.evaluations[POLICY].scores["tracking_error_cm"]
    index = int(np.argsort(scores)[len(scores) // 2])
    which = int(rollouts.demonstration[index])
    demonstration = results.env.demonstrations[which]
    model = demonstration_spec(demonstration, results.env.hands[which], visual=True).compile()
    frames = (np.array(MOMENTS) * (demonstration.num_frames - 1)).astype(int)
    targets = np.asarray(results.env.reference.targets)[which, frames]
    wanted = np.concatenate([targets, rollouts.object_reference[index, frames]], axis=1)
    rows = [
        np.concatenate(list(render_frames(model, take, watched=wanted, size=SIZE)), axis=1)
        for take in (wanted, rollouts.qpos[index, frames])
    ]
    picture = Image.fromarray(np.concatenate(rows)).reduce(2).quantize(256)
    picture.save(Path(__file__).with_name("twin.png"), optimize=True)


if __name__ == "__main__":
    main()

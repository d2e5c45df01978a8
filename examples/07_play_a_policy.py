"""Roll out a policy that comes with the project, print its scores and write a video, without any training.

    python examples/07_play_a_policy.py [pinch|lateral|power|cylindrical|spherical|all]

In the browser instead: `python -m train.play config=pinch`.
"""

import dataclasses
import sys
from pathlib import Path

import mjx_hand
from mjx_hand.view.video.renderer import RendererUnavailable
from train.experiment.bundled_policies import bundled_env, bundled_policy
from train.experiment.setup import rolled_out
from train.settings.config import compose
from train.view.video import side_by_side

OUT = Path("outputs/examples")


def main(grasp: str = "pinch") -> None:
    """Follow the demonstration that comes with the policy."""
    policy = bundled_policy(grasp)
    if policy is None:
        raise mjx_hand.InputError(f"no policy named {grasp!r} comes with the project; try pinch")
    config = dataclasses.replace(compose([f"config={grasp}"]), checkpoint=str(policy), engine="native")
    env = bundled_env(config)
    demonstration = env.demonstrations[0]
    print(f"{grasp}: a {demonstration.object.kind} of {1e3 * demonstration.object.mass:.0f} g")

    _, rollouts, evaluation = rolled_out(config, env)
    for name, value in evaluation.rows().items():
        print(f"  {name:28} {value:.3f}")

    OUT.mkdir(parents=True, exist_ok=True)
    video = OUT / f"{grasp}.mp4"
    try:
        side_by_side(env, rollouts, 0, video)
    except RendererUnavailable as error:
        print(f"no video: {error}")
        return
    print(f"{video}: left the demonstration, right the twin")


if __name__ == "__main__":
    main(*sys.argv[1:2])

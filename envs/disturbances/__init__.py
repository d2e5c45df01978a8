"""What differs from a recording: drawn anew for each episode to train on, or set to one value to test with."""

from envs.disturbances.episode import Episode, EpisodeTables, draw_episode, episode_tables
from envs.disturbances.randomize import Randomize
from envs.disturbances.variation import Variation, draw_variations, varied_pose

__all__ = [
    "Episode",
    "EpisodeTables",
    "Randomize",
    "Variation",
    "draw_episode",
    "draw_variations",
    "episode_tables",
    "varied_pose",
]

"""Entry points: training, evaluation, benchmarks and the demo."""

import envs  # noqa: F401  first, before any module imports Brax: it keeps MJX's remarks about Warp off the terminal

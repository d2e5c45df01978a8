"""Entry points: training, evaluation, benchmarks and the demo; `__init__.pyi` lists the public names."""

import envs  # noqa: F401  first, before any module imports Brax: it keeps MJX's remarks about Warp off the terminal
from mjx_hand.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)  # type: ignore[assignment]  # the stub's names

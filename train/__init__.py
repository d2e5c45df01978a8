"""Entry points: training, evaluation, benchmarks and the demo; `__init__.pyi` lists the public names."""

import sys

from mjx_hand.cli.packages import check_packages
from mjx_hand.errors import InputError

try:
    check_packages()
except InputError as error:
    if sys.argv[0] != "-m":
        raise
    # `python -m train.ppo`, which is still looking for its module: there is no command yet that would say it in a line.
    print(f"train: {error}", file=sys.stderr)
    sys.exit(2)

import envs  # noqa: F401  before any module imports Brax: it keeps MJX's remarks about Warp off the terminal
from mjx_hand.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)  # type: ignore[assignment]  # the stub's names

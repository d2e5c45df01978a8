"""Physics twins of hands: scenes, engines, demonstrations, and the environment in which a twin tracks them.

`__init__.pyi` lists the public names.
"""

import contextlib
import importlib.util
import io

from mjx_hand.lazy_exports import lazy_exports

if importlib.util.find_spec("warp") is None:
    # MJX, which Brax imports whatever the engine, prints that Warp is missing. Here it is optional, and who asks for it
    # is told how to install it; commands should not begin with two lines that look like errors.
    with contextlib.redirect_stdout(io.StringIO()):
        import mujoco.mjx  # noqa: F401

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)  # type: ignore[assignment]  # the stub's names

"""Physics twins of hands: scenes, engines, demonstrations, and the environment in which a twin tracks them."""

import contextlib
import importlib.util
import io

if importlib.util.find_spec("warp") is None:
    # MJX, which Brax imports whatever the engine, prints that Warp is missing. Here it is optional, and who asks for it
    # is told how to install it; commands should not begin with two lines that look like errors.
    with contextlib.redirect_stdout(io.StringIO()):
        import mujoco.mjx  # noqa: F401

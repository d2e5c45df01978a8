"""Opening MuJoCo's off-screen renderer wherever it is, with or without a display."""

import contextlib
import ctypes
import importlib
import os
import sys
from collections.abc import Iterator

import mujoco
from mujoco.rendering.classic import gl_context

PACKAGES = "libegl1 libegl-mesa0 libgl1-mesa-dri libgles2"


class RendererUnavailable(RuntimeError):
    """No off-screen renderer can be had here; the message says why and how to get one."""


@contextlib.contextmanager
def open_renderer(model: mujoco.MjModel, width: int, height: int) -> Iterator[mujoco.Renderer]:
    """A renderer of pictures of this size, closed at the end.

    Where MUJOCO_GL is not set and there is no display (Linux), EGL is chosen, or OSMesa where EGL is not installed, and
    MUJOCO_GL set accordingly. The model's off-screen buffer must be large enough.

    Raises:
        RendererUnavailable: MuJoCo cannot make a graphics context.
    """
    try:
        _choose_backend()
        renderer = mujoco.Renderer(model, height=height, width=width)
    except RendererUnavailable:
        raise
    except Exception as error:  # each backend fails in its own way, some with AttributeError
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise RendererUnavailable(_advice(reason)) from error
    try:
        yield renderer
    finally:
        renderer.close()


def _choose_backend() -> None:
    """Set MUJOCO_GL if nobody has and the default, a window, cannot work; MuJoCo reads it as it is imported."""
    if os.environ.get("MUJOCO_GL") or sys.platform != "linux":
        return
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        return
    for backend, library in (("egl", "libEGL.so.1"), ("osmesa", "libOSMesa.so.8")):
        if _loads(library):
            os.environ["MUJOCO_GL"] = backend
            importlib.reload(gl_context)  # MuJoCo was imported before, and settled on a window then
            return
    raise RendererUnavailable(_advice("neither EGL nor OSMesa is installed, and there is no display"))


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _advice(reason: str) -> str:
    backend = os.environ.get("MUJOCO_GL")
    setting = f"MUJOCO_GL={backend}" if backend else "MUJOCO_GL not set"
    return (
        f"no off-screen renderer ({setting}): {reason}; on Debian or Ubuntu install {PACKAGES} and set MUJOCO_GL=egl, "
        "which needs neither a display nor a GPU"
    )

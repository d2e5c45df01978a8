"""Videos of a scene: off-screen pictures of a row of qpos, captions, two takes side by side, and H.264 files."""

import contextlib
import itertools
from collections.abc import Generator, Iterable, Sequence
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float, UInt8
from matplotlib import font_manager
from PIL import Image, ImageDraw, ImageFont

from mjx_hand.errors import InputError
from mjx_hand.files.npz_archive import replacing
from mjx_hand.view.video.camera import Camera, camera_path
from mjx_hand.view.video.encoder import encoder
from mjx_hand.view.video.renderer import open_renderer
from mjx_hand.view.video.studio import COLLISION_GROUP, add_arrows, light_scene, studio_model

Frame = UInt8[np.ndarray, "h w 3"]


def render_frames(
    model: mujoco.MjModel,
    qpos: Float[np.ndarray, "t nq"],
    camera: Camera | None = None,
    *,
    watched: Float[np.ndarray, "_ _"] | None = None,
    arrows: Float[np.ndarray, "_ _ 2 3"] | None = None,
    size: tuple[int, int] = (640, 480),
    caption: str = "",
) -> Generator[Frame, None, None]:
    """Yield one picture per row of qpos.

    Args:
        model: the scene, with visual meshes; it is left as it is.
        qpos: what to show.
        camera: the default follows the body "object".
        watched: the take whose object the camera follows, so that two takes side by side are seen alike; the default
            is qpos itself.
        arrows: from where to where (m) arrows go in each picture; one with NaN is not drawn.
        size: width and height in pixels, both even.
        caption: written into the top left corner.

    Raises:
        InputError: rows of another length than the model's qpos, an odd size, or no body of the followed name.
        RendererUnavailable: there is no way to render on this machine.
    """
    camera = Camera() if camera is None else camera
    width, height = size
    if width % 2 or height % 2 or width < 2 or height < 2:
        raise InputError(f"size is {width}x{height}; H.264 needs an even width and height, such as 640x480")
    if qpos.shape[1] != model.nq:
        raise InputError(f"qpos has {qpos.shape[1]} columns, but the model has {model.nq}; give that model's own qpos")
    watched = qpos if watched is None else watched
    if watched.shape != qpos.shape:
        raise InputError(f"watched has shape {watched.shape}, but qpos has {qpos.shape}; give takes of one length")
    arrows = np.zeros((len(qpos), 0, 2, 3)) if arrows is None else arrows
    if len(arrows) != len(qpos):
        raise InputError(f"arrows of {len(arrows)} pictures are given for {len(qpos)} rows of qpos; give some for each")
    return _frames(model, qpos, arrows, camera_path(model, watched, camera), size, caption)


def _frames(
    model: mujoco.MjModel,
    qpos: Float[np.ndarray, "t nq"],
    arrows: Float[np.ndarray, "t n 2 3"],
    path: Sequence[mujoco.MjvCamera],
    size: tuple[int, int],
    caption: str,
) -> Generator[Frame, None, None]:
    shown = studio_model(model, *size)
    data = mujoco.MjData(shown)
    option = mujoco.MjvOption()
    option.geomgroup[COLLISION_GROUP] = 1  # of links that have no mesh, by studio_model()
    label = _Caption(caption, size) if caption else None
    with open_renderer(shown, *size) as renderer:
        for row, drawn, view in zip(qpos, arrows, path, strict=True):
            data.qpos[:] = row
            mujoco.mj_kinematics(shown, data)
            mujoco.mj_comPos(shown, data)
            mujoco.mj_camlight(shown, data)
            renderer.update_scene(data, view, option)
            light_scene(renderer.scene, view)
            add_arrows(renderer.scene, drawn)
            frame = renderer.render()
            yield label.drawn_on(frame) if label else frame


def beside(
    left: Generator[Frame, None, None], right: Generator[Frame, None, None], gap: int = 4
) -> Generator[Frame, None, None]:
    """Frames of two takes side by side, as long as the shorter one, with `gap` pixels (even) between."""
    with contextlib.closing(left), contextlib.closing(right):  # the longer one's renderer must not linger
        for a, b in zip(left, right, strict=False):
            between = np.full((a.shape[0], gap, 3), 255, np.uint8)
            yield np.concatenate([a, between, b], axis=1)


def write_video(path: str | Path, frames: Iterable[Frame], fps: float) -> None:
    """Write an MP4 (H.264, yuv420p) that every browser plays; the file appears whole or not at all.

    Raises:
        InputError: no frames, frames of odd or differing size, another suffix than .mp4, or a bad rate.
    """
    if Path(path).suffix != ".mp4":
        raise InputError(f"{path}: videos are MP4; give a name that ends in .mp4")
    if not np.isfinite(fps) or fps <= 0:
        raise InputError(f"fps is {fps}; give a positive number of frames per second")
    frames = iter(frames)
    first = next(frames, None)
    if first is None:
        raise InputError(f"{path}: there are no frames to write")
    height, width = first.shape[:2]
    if width % 2 or height % 2:
        raise InputError(f"{path}: frames are {width}x{height}; H.264 needs an even width and height")
    with replacing(path) as temporary, encoder(temporary, width, height, fps) as write:
        for frame in itertools.chain([first], frames):
            if frame.shape != first.shape:
                raise InputError(f"{path}: frames of {first.shape} and {frame.shape}; all must have one size")
            write(np.ascontiguousarray(frame).tobytes())


class _Caption:
    """A line of text on a darkened plate, drawn once and laid over each frame."""

    def __init__(self, text: str, size: tuple[int, int]):
        font = ImageFont.truetype(font_manager.findfont("DejaVu Sans"), max(12, size[1] // 24))
        left, top, right, bottom = font.getbbox(text)
        pad = max(6, size[1] // 60)
        self.plate = Image.new(
            "RGBA", (round(right - left) + 2 * pad, round(bottom - top) + 2 * pad), (20, 24, 31, 190)
        )
        ImageDraw.Draw(self.plate).text((pad - left, pad - top), text, font=font, fill=(255, 255, 255, 255))
        self.at = (2 * pad, 2 * pad)

    def drawn_on(self, frame: Frame) -> Frame:
        picture = Image.fromarray(frame)
        picture.paste(self.plate, self.at, self.plate)
        return np.asarray(picture)

import os
import subprocess
import sys

import imageio_ffmpeg
import mujoco
import numpy as np
import pytest

from mjx_hand.errors import InputError
from mjx_hand.view.video.camera import Camera, camera_path
from mjx_hand.view.video.video import beside, render_frames, write_video

SCENE = """
<mujoco>
  <worldbody>
    <geom name="table" type="plane" size="1 1 .1" rgba=".8 .8 .8 1"/>
    <body name="wrist" pos="0 -.1 .2" euler="{euler}">
      <joint name="lift" type="slide" axis="0 0 1"/>
      <geom type="box" size=".02 .02 .02" rgba=".2 .4 .9 1" group="2"/>
    </body>
    <body name="object"><freejoint/><geom type="box" size=".02 .02 .02" rgba=".95 .1 .1 1"/></body>
  </worldbody>
</mujoco>
"""
SIZE = (160, 120)


def scene(euler: str = "0 0 0") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(SCENE.format(euler=euler))


def way(frames: int = 3) -> np.ndarray:
    """The object goes 20 cm sideways and up."""
    qpos = np.zeros((frames, 8))
    qpos[:, 1] = np.linspace(0.0, 0.2, frames)
    qpos[:, 3] = np.linspace(0.02, 0.2, frames)
    qpos[:, 4] = 1.0
    return qpos


def red(frame: np.ndarray) -> np.ndarray:
    """Pixels of the object."""
    r, g, b = np.moveaxis(frame.astype(int), -1, 0)
    return (r > 100) & (r > 2 * g) & (r > 2 * b)


@pytest.fixture(scope="module")
def frames() -> list[np.ndarray]:
    return list(render_frames(scene(), way(), Camera(smoothing=0.1), size=SIZE))


def test_the_object_stays_in_the_middle_though_it_moves(frames):
    assert len(frames) == 3
    for frame in frames:
        assert frame.shape == (120, 160, 3)
        row, column = np.argwhere(red(frame)).mean(axis=0)
        assert abs(column - 80) < 8
        assert 60 < row < 85  # a little low, so that the hand above it is in view


def test_pictures_are_lit_and_have_a_light_background(frames):
    for frame in frames:
        assert frame[:5].mean() > 180
        assert frame.std() > 10


def test_shadows_fall_on_the_table(frames):
    floor = frames[0][red(frames[0]).any(axis=1).argmax() :].astype(int)
    assert floor.sum(axis=-1).min() < 0.7 * np.median(floor.sum(axis=-1))


def test_arrows_reach_from_where_to_where():
    """Forth and back it covers the same columns, which it would not if it ended early; one of NaN is not drawn."""
    ends = np.array([[-0.08, 0.0, 0.15], [0.08, 0.0, 0.15]])
    asked = {"none": np.full((2, 3), np.nan), "forth": ends, "back": ends[::-1]}
    camera = Camera(azimuth=90.0)
    seen = {
        name: next(render_frames(scene(), way(1), camera, arrows=arrow[None, None], size=SIZE)).astype(int)
        for name, arrow in asked.items()
    }
    plain = next(render_frames(scene(), way(1), camera, size=SIZE)).astype(int)
    np.testing.assert_array_equal(seen["none"], plain)
    blue = {name: (seen[name][..., 2] - seen[name][..., 0] > 60) & (seen[name] != plain).any(-1) for name in asked}
    columns = [np.flatnonzero(blue[name].any(axis=0)) for name in ("forth", "back")]
    assert np.ptp(columns[0]) > 30
    for one, other in zip(*((c.min(), c.max()) for c in columns), strict=True):
        assert abs(one - other) <= 3
    with pytest.raises(InputError, match="arrows of 2 pictures are given for 1 rows of qpos"):
        render_frames(scene(), way(1), arrows=np.zeros((2, 1, 2, 3)), size=SIZE)


def test_the_model_is_left_as_it_is():
    model, untouched = scene(), scene()
    next(render_frames(model, way(), size=SIZE)).sum()
    np.testing.assert_array_equal(model.geom_rgba, untouched.geom_rgba)
    np.testing.assert_array_equal(model.geom_size, untouched.geom_size)
    assert model.vis.global_.offwidth == untouched.vis.global_.offwidth


def test_captions_change_their_corner_alone(frames):
    (captioned,) = render_frames(scene(), way()[:1], Camera(smoothing=0.1), size=SIZE, caption="Twin")
    (plain,) = render_frames(scene(), way()[:1], Camera(smoothing=0.1), size=SIZE)
    changed = np.argwhere((captioned != plain).any(axis=-1))
    assert len(changed) > 100
    assert changed[:, 0].max() < 40
    assert changed[:, 1].max() < 80


def test_a_watched_take_decides_where_the_camera_is():
    near, still = Camera(smoothing=0.1, distance=0.8), np.tile(way()[:1], (3, 1))
    own, other = (
        [np.argwhere(red(frame)).mean(axis=0) for frame in render_frames(scene(), way(), near, watched=take, size=SIZE)]
        for take in (None, still)
    )
    assert np.linalg.norm(own[2] - own[0]) < 8
    assert np.linalg.norm(other[2] - other[0]) > 16


@pytest.mark.parametrize(
    ("euler", "toward"),
    # Thumb side is +z of the hand, fingers -x: the camera stands on their side.
    [("-90 0 0", (-0.45, 0.9)), ("90 0 0", (-0.45, -0.9))],
)
def test_the_camera_stands_on_the_thumbs_side(euler, toward):
    view = camera_path(scene(euler), way(), Camera())[0]
    ahead = np.array([np.cos(np.deg2rad(view.azimuth)), np.sin(np.deg2rad(view.azimuth))])
    np.testing.assert_allclose(ahead, -np.array(toward) / np.linalg.norm(toward), atol=1e-9)


def decoded(path) -> np.ndarray:
    command = [
        imageio_ffmpeg.get_ffmpeg_exe(),
        "-v",
        "error",
        "-i",
        str(path),
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-",
    ]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8)


def test_a_video_holds_its_frames(tmp_path, frames):
    path = tmp_path / "folder" / "a.mp4"
    write_video(path, frames, 25.0)
    found = decoded(path).reshape(-1, 120, 160, 3)
    assert len(found) == len(frames)
    assert np.abs(found.astype(int) - np.stack(frames)).mean() < 6  # H.264 loses a little
    about = subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path)], capture_output=True, text=True).stderr
    assert "h264" in about
    assert "yuv420p" in about
    assert "25 fps" in about


def test_two_takes_side_by_side(tmp_path, frames):
    def colour(value: int, count: int):
        for _ in range(count):
            yield np.full((120, 160, 3), value, np.uint8)

    both = list(beside(colour(0, 5), colour(200, 3)))
    assert len(both) == 3
    assert both[0].shape == (120, 324, 3)
    assert both[0][:, :160].max() == 0
    assert both[0][:, 164:].min() == 200
    write_video(tmp_path / "b.mp4", both, 30.0)


def test_a_broken_video_leaves_no_file(tmp_path, frames):
    def breaking():
        yield frames[0]
        raise KeyError("renderer gone")

    with pytest.raises(KeyError, match="renderer gone"):
        write_video(tmp_path / "a.mp4", breaking(), 25.0)
    with pytest.raises(InputError, match="one size"):
        write_video(tmp_path / "a.mp4", [frames[0], frames[0][:60]], 25.0)
    with pytest.raises(InputError, match="no frames"):
        write_video(tmp_path / "a.mp4", [], 25.0)
    with pytest.raises(InputError, match=r"ends in \.mp4"):
        write_video(tmp_path / "a.avi", frames, 25.0)
    with pytest.raises(InputError, match="159x120"):
        write_video(tmp_path / "a.mp4", [frames[0][:, :159]], 25.0)
    with pytest.raises(InputError, match="fps is 0"):
        write_video(tmp_path / "a.mp4", frames, 0.0)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"size": (161, 120)}, "161x120"),
        ({"camera": Camera(follow="cup")}, "no body 'cup' to follow; it has wrist, object"),
        ({"watched": np.zeros((2, 8))}, r"watched has shape \(2, 8\)"),
    ],
)
def test_bad_input_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        next(render_frames(scene(), way(), **{"size": SIZE, **change}))
    with pytest.raises(InputError, match="7 columns, but the model has 8"):
        render_frames(scene(), way()[:, :7], size=SIZE)


SCRIPT = """
import mujoco
from mjx_hand.view.video.renderer import RendererUnavailable, open_renderer
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='.1'/></worldbody></mujoco>")
try:
    with open_renderer(model, 64, 48) as renderer:
        renderer.update_scene(mujoco.MjData(model))
        print("rendered", renderer.render().shape)
except RendererUnavailable as error:
    print(error)
"""


def run_without_display(**setting: str) -> str:
    hidden = ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY", "PYOPENGL_PLATFORM", "MUJOCO_EGL_DEVICE_ID")
    environment = {name: value for name, value in os.environ.items() if name not in hidden} | setting
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", SCRIPT], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    "setting", [{"MUJOCO_GL": "glfw"}, {"MUJOCO_GL": "disabled"}, {"MUJOCO_GL": "egl", "MUJOCO_EGL_DEVICE_ID": "99"}]
)
def test_where_nothing_renders_the_message_says_what_to_install(setting):
    told = run_without_display(**setting)
    assert told.startswith(f"no off-screen renderer (MUJOCO_GL={setting['MUJOCO_GL']}): ")
    assert "libegl1 libegl-mesa0 libgl1-mesa-dri libgles2" in told
    assert told.count("\n") == 1


def test_without_display_or_setting_a_backend_is_chosen():
    assert run_without_display() == "rendered (48, 64, 3)\n"

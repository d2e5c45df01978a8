"""The browser viewer: a scene with a time line, played in real time (https://viser.studio)."""

import contextlib
import io
import sys
import threading
import time
from collections.abc import Iterator

import numpy as np
import viser
from jaxtyping import Float
from viser import uplot

from mjx_hand.errors import InputError
from mjx_hand.pytree import replace
from mjx_hand.view.browser.address import browser_address, free_port, is_public
from mjx_hand.view.browser.gate import guarded_server
from mjx_hand.view.browser.nodes import Handle, Show, add_layer
from mjx_hand.view.browser.playback import SPEEDS, Playback
from mjx_hand.view.browser.scene import Scene, check_scene, positions

PORT = 8080
TICK = 1 / 40  # seconds between looks at the clock; more frames than that a browser far away does not get
_COLOURS = ("#3b6fb6", "#d1603d", "#4c9a6a", "#8a5fb0")
_AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
_PLANES = {"x": "yz", "y": "xz", "z": "xy"}
_SPEEDS = {f"{speed:g}x": speed for speed in SPEEDS}


class Viewer:
    """A scene in the browser, at `url` until `close`, with time line, speed, layers and curves.

    Attributes:
        scene: what is shown.
        server: viser's server, for more of one's own.
        host: the address that it listens on.
        frame: the frame shown now.
        switches: the layers' checkboxes, in the scene's order.
    """

    def __init__(self, scene: Scene, port: int = PORT, host: str = "127.0.0.1") -> None:
        """Serve `scene`; its first frame is shown, paused.

        Args:
            scene: what to show.
            port: to serve at; 0 chooses a free one.
            host: address to listen on; "0.0.0.0" lets other computers look too.

        Raises:
            InputError: the scene cannot be shown, or the port is not free.
        """
        self.scene = check_scene(scene)
        free = free_port(host, port)
        with contextlib.redirect_stdout(io.StringIO()):  # viser's banner; whoever asked for a viewer says where it is
            self.server = guarded_server(host, free, "mjx-hand")
        self.host = host
        self.frame = 0
        self._playback: Playback | None = None
        self._lock = threading.RLock()
        self._closed = threading.Event()
        self._set_stage()
        layers = [(layer, *add_layer(self.server, layer)) for layer in scene.layers]
        self._layers = [(root, move) for _, root, move in layers]
        self._add_time_line()
        with self.server.gui.add_folder("Layers"):
            self.switches = [self._add_switch(layer.name, root, move) for layer, root, move in layers]
        self._add_curves()
        self._clock = threading.Thread(target=self._run, daemon=True, name="mjx-hand viewer")
        self._clock.start()

    @property
    def url(self) -> str:
        """Where to point a browser on this computer."""
        return f"http://{browser_address(self.host)}:{self.server.get_port()}"

    @property
    def public(self) -> bool:
        """Whether other computers can look, and steer, too."""
        return is_public(self.host)

    def show(self, frame: int) -> None:
        """Show a frame; playing goes on from there."""
        with self._lock:
            self._draw(int(np.clip(frame, 0, self.scene.num_frames - 1)))
            if self._playback is not None:
                self._playback = replace(self._playback, began=time.monotonic(), start=self.frame)

    def play(self, speed: float | None = None) -> None:
        """Play from the frame shown, or from the first if it is the last; at `speed` times real time.

        Raises:
            InputError: a speed that is none of `playback.SPEEDS`.
        """
        with self._lock:
            if speed is not None:
                if speed not in SPEEDS:
                    raise InputError(f"speed is {speed}; valid: {', '.join(map(str, SPEEDS))}")
                self._speed.value = f"{speed:g}x"
            start = 0 if self.frame == self.scene.num_frames - 1 else self.frame
            self._playback = Playback(
                frames=self.scene.num_frames,
                fps=self.scene.fps,
                began=time.monotonic(),
                start=start,
                speed=_SPEEDS[self._speed.value],
                loop=self._loop.value,
            )
            self._button.label, self._button.icon = "Pause", viser.Icon.PLAYER_PAUSE

    def pause(self) -> None:
        """Stay at the frame shown."""
        with self._lock:
            self._playback = None
            self._button.label, self._button.icon = "Play", viser.Icon.PLAYER_PLAY

    def close(self) -> None:
        """Stop serving."""
        self._closed.set()
        self._clock.join()
        with contextlib.redirect_stdout(io.StringIO()):  # viser says that it stopped
            self.server.stop()

    def wait(self) -> None:
        """Serve until the process is interrupted (Ctrl-C)."""
        with contextlib.suppress(KeyboardInterrupt):
            while not self._closed.wait(3600):
                pass

    def _draw(self, frame: int) -> None:
        self.frame = frame
        with self.server.atomic():
            for root, move in self._layers:
                if root.visible:  # hidden layers follow when they are shown again
                    move(frame)
            self._slider.value = frame
            self._time.value = f"{frame / self.scene.fps:.2f} s of {(self.scene.num_frames - 1) / self.scene.fps:.2f} s"
            for curve, text in zip(self.scene.curves, self._figures, strict=True):
                value = curve.values[frame]
                text.value = f"{value:.2f} {curve.unit}" if np.isfinite(value) else "none in this frame"

    def _run(self) -> None:
        while not self._closed.wait(TICK):
            with self._lock:
                try:
                    self._tick()
                except Exception as error:  # whatever went wrong in one frame, Play works for everybody afterwards
                    self._playback = None
                    print(f"mjx-hand: the viewer paused ({type(error).__name__}: {error})", file=sys.stderr)

    def _tick(self) -> None:
        if self._playback is None:
            return
        now = time.monotonic()
        due = self._playback.frame(now)
        if due != self.frame:
            self._draw(due)
        if self._playback.over(now):
            self.pause()

    def _set_stage(self) -> None:
        """Lights, the ground, and where the camera begins."""
        server, scene = self.server, self.scene
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        server.scene.set_up_direction(scene.up)  # type: ignore[arg-type]
        up = np.array(_AXES[scene.up[1]], float) * (1 if scene.up[0] == "+" else -1)
        low, high = _bounds(scene)
        centre, size = (low + high) / 2, float(np.linalg.norm(high - low))
        height = scene.ground if scene.ground is not None else float(min(low @ up, high @ up)) - 0.02
        server.scene.add_grid(
            "/ground",
            plane=_PLANES[scene.up[1]],  # type: ignore[arg-type]
            infinite_grid=True,
            cell_size=0.05,
            section_size=0.25,
            cell_color=(214, 217, 222),
            section_color=(180, 185, 193),
            fade_distance=4.0,
            plane_color=(246, 247, 249),
            plane_opacity=1.0,
            shadow_opacity=0.25,
            position=centre - (centre @ up) * up + height * up,
        )
        _add_lights(server, up)
        camera = server.initial_camera
        camera.fov = np.deg2rad(35.0)
        camera.look_at = centre
        camera.position = centre + _viewpoint(up) * max(1.8 * size, 0.35)

    def _add_time_line(self) -> None:
        gui, last = self.server.gui, self.scene.num_frames - 1
        gui.add_markdown(f"**{self.scene.title}**  \n{last + 1} frames at {self.scene.fps:g}/s")
        self._slider = gui.add_slider("Frame", min=0, max=max(last, 1), step=1, initial_value=0, disabled=last == 0)
        self._button = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY, disabled=last == 0)
        self._speed = gui.add_dropdown("Speed", list(_SPEEDS), initial_value="1x")
        self._loop = gui.add_checkbox("Loop", initial_value=True)
        self._time = gui.add_text("Time", "", disabled=True)

        @self._slider.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:  # moved by a person, not by `_draw`
                self.show(int(self._slider.value))

        @self._button.on_click
        def _(event: viser.GuiEvent) -> None:
            self.play() if self._playback is None else self.pause()

        def begin_again(event: viser.GuiEvent) -> None:
            if event.client is not None and self._playback is not None:
                self.play()

        self._speed.on_update(begin_again)
        self._loop.on_update(begin_again)

    def _add_switch(self, name: str, root: Handle, move: Show) -> viser.GuiCheckboxHandle:
        box = self.server.gui.add_checkbox(name, initial_value=root.visible)

        @box.on_update
        def _(event: viser.GuiEvent) -> None:
            with self._lock:
                move(self.frame)
                root.visible = box.value

        return box

    def _add_curves(self) -> None:
        self._figures: list[viser.GuiInputHandle[str]] = []
        if not self.scene.curves:
            self._draw(0)
            return
        seconds = np.arange(self.scene.num_frames) / self.scene.fps
        with self.server.gui.add_folder("Errors"):
            for curve in self.scene.curves:
                self._figures.append(self.server.gui.add_text(curve.name, "", disabled=True))
            self.server.gui.add_uplot(
                (seconds, *(curve.values.astype(float) for curve in self.scene.curves)),
                (
                    uplot.Series(label="s"),
                    *(
                        uplot.Series(label=f"{curve.name} ({curve.unit})", stroke=_COLOURS[k % len(_COLOURS)], width=2)
                        for k, curve in enumerate(self.scene.curves)
                    ),
                ),
                scales={"x": uplot.Scale(time=False, auto=True), "y": uplot.Scale(auto=True)},
                aspect=2.0,
                padding=(16, 8, 0, 0),
            )
        self._draw(0)


@contextlib.contextmanager
def serving(scene: Scene, port: int = PORT, host: str = "127.0.0.1") -> Iterator[Viewer]:
    """A `Viewer` that is closed at the end of the block."""
    viewer = Viewer(scene, port, host)
    try:
        yield viewer
    finally:
        viewer.close()


def _bounds(scene: Scene) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """The box in which nearly all of the motion happens, with room for fingers around their joints."""
    at = positions(scene).reshape(-1, 3)
    at = at[np.isfinite(at).all(axis=1)]
    low, high = np.quantile(at, [0.02, 0.98], axis=0)
    return low - 0.02, high + 0.02


def _add_lights(server: viser.ViserServer, up: Float[np.ndarray, "3"]) -> None:
    """A key light with shadows from the camera's side, a cooler fill light, and light from all around."""
    server.scene.configure_default_lights(enabled=False)
    side = np.roll(np.abs(up), 1)
    front = np.cross(side, up)
    key, fill = 1.2 * up - 0.5 * front + 0.7 * side, 0.4 * up - 0.4 * front - 1.0 * side
    server.scene.add_light_ambient("/lights/ambient", intensity=0.9)
    server.scene.add_light_directional(
        "/lights/key", color=(255, 247, 238), intensity=1.9, cast_shadow=True, position=tuple(key)
    )
    server.scene.add_light_directional("/lights/fill", color=(226, 236, 255), intensity=0.7, position=tuple(fill))


def _viewpoint(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """From where to look: in front, to one side and above."""
    side = np.roll(np.abs(up), 1)
    front = np.cross(side, up)
    way = -1.0 * front - 0.55 * side + 0.5 * up
    return way / np.linalg.norm(way)

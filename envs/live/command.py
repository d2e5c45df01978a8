"""The twin of the hand in front of you, in contact physics, live in the browser: `mjx-hand live --source webxr`."""

import contextlib
import json
import secrets
import socket
import ssl
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

import tyro

from envs.live.assistance import assistance
from envs.live.service.certificate import secure_context
from envs.live.session import serving
from envs.live.sources.datagrams import Datagrams
from envs.live.sources.mailbox import Mailbox
from envs.live.sources.recorded import Recorded, open_recording
from envs.live.sources.source import Source
from envs.live.sources.webcam import Webcam
from envs.live.twin.tabletop import Tabletop, demonstration_table, tabletop
from mjx_hand.cli.terminal.usage import later, parsed
from mjx_hand.compile_cache import enable_compile_cache
from mjx_hand.errors import InputError
from mjx_hand.view.browser.address import browser_address, free_port, is_public

PORT, UDP_PORT = 8123, 9123
_OBJECT = "pinch"
Up = Literal["+x", "-x", "+y", "-y", "+z", "-z"]


def live(
    source: str = "webcam",
    object: str | None = None,
    mass: float | None = None,
    side: Literal["right", "left"] | None = None,
    up: Up | None = None,
    fps: float | None = None,
    once: bool = False,
    seconds: float | None = None,
    assist: Literal["off", "grip", "policy"] = "off",
    policy: Path | None = None,
    camera: int = 0,
    host: str = "127.0.0.1",
    port: int = PORT,
    udp_port: int = UDP_PORT,
    https: bool = False,
    token: str | None = None,
    publish: Annotated[tuple[str, ...], tyro.conf.arg(metavar="HOST:PORT")] = (),
    out: Path = Path("outputs/live"),
) -> None:
    """Show the twin of a hand, live, with an object on a table, until Ctrl-C; print its timing as JSON at the end.

    Args:
        source: webcam, webxr (a headset's browser opens the page), udp or ws (messages of other programs), or a file: a
            recording of keypoints or of a hand, a scene, or a demonstration, at its own pace.
        object: of a grasp type (pinch, lateral, cylindrical, spherical, power), or a mesh in metres (.stl, .obj, …); of
            a demonstration its own.
        mass: of the object (kg).
        side: which hand; right where nothing says it.
        up: the source's axis against gravity, where it is another than usual: +y of headsets, -y of cameras.
        fps: frames a second, of a recording that does not say.
        once: end with the recording, which else begins again.
        seconds: end after that time.
        assist: policy lets a trained policy move the fingers beside their tracked way, so that they hold what they
            reach for; grip presses what the fingers touch, as the references of training do; off leaves fingers as
            they are tracked.
        policy: of your own for --assist policy: what train.export writes of a run of config=live.
        camera: number of the webcam.
        host: address to listen on; 0.0.0.0, or this computer's own, lets other computers and headsets in.
        port: of the page and of websockets; 0 chooses a free one.
        udp_port: of messages; 0 chooses a free one.
        https: serve with a certificate made on the spot, as headsets want it of other computers.
        token: for the address, in place of a new one; 16 letters or more.
        publish: where the twin's state goes by UDP, as JSON.
        out: folder for recordings.
    """
    if token is not None and (len(token) < 16 or not token.isalnum()):
        raise InputError("--token is too easy to guess, or has other signs than letters and digits; give 16 or more")
    if seconds is not None and not seconds > 0:
        raise InputError(f"--seconds is {seconds:g}; give a positive number")
    addresses = tuple(map(_address, publish))
    free_port(host, port)  # before seconds are spent on what else is needed
    frames = _source(source, side, up, fps, not once, camera, host, udp_port)
    shown = frames.demonstration if isinstance(frames, Recorded) else None
    if shown is not None and object is not None:
        raise InputError(f"{source}: a demonstration has an object of its own; leave out --object")
    table: Tabletop = demonstration_table(shown) if shown is not None else tabletop(object or _OBJECT, mass)
    which = frames.side if isinstance(frames, Recorded) else side or "right"
    helper = assistance(assist, which, policy)
    _say("one moment")
    token = token or secrets.token_hex(16)
    with (
        _security(https or (source == "webxr" and is_public(host)), host) as secure,
        serving(
            frames,
            table,
            which,
            token,
            host=host,
            port=port,
            publish=addresses,
            secure=secure,
            folder=out,
            assist=helper,
        ) as session,
    ):
        _greet(source, host, session.server.port, token, secure is not None, frames)
        with contextlib.suppress(KeyboardInterrupt):
            session.pipeline.wait(seconds)
    print(json.dumps(session.timing.report(), indent=1))


def _source(
    name: str, side: str | None, up: str | None, fps: float | None, loop: bool, camera: int, host: str, udp_port: int
) -> Source:
    """The source of that name, or the recording in that file."""
    made: Source
    if name == "webcam":
        made = Webcam(side or "right", camera)
    elif name == "udp":
        made = Datagrams(host, udp_port)
    elif name in ("ws", "webxr"):
        made = Mailbox("websocket" if name == "ws" else "headset")
    elif Path(name).exists():
        return open_recording(Path(name), side, fps, up, loop)
    else:
        raise InputError(f"source is {name!r}; valid: webcam, webxr, udp, ws, or the path of a recording")
    if fps is not None or not loop:
        raise InputError(f"--source {name} is no recording; leave out --fps and --once")
    made.up = up or made.up
    return made


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65536:
        raise InputError(f"--publish {text}: give HOST:PORT, such as 127.0.0.1:9200")
    try:
        found = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_DGRAM)
    except OSError as error:
        raise InputError(f"--publish {text}: {host!r} is not found ({error.strerror}); give an address") from None
    return str(found[0][4][0]), int(port)


@contextlib.contextmanager
def _security(wanted: bool, host: str) -> Iterator[ssl.SSLContext | None]:
    """TLS while the block runs; its key is deleted at the end."""
    if not wanted:
        yield None
        return
    with tempfile.TemporaryDirectory(prefix="mjx-hand-") as folder:
        yield secure_context(Path(folder), browser_address(host))


def _greet(source: str, host: str, port: int, token: str, secure: bool, frames: Source) -> None:
    """Say where to look, and who else can."""
    address = f"{'https' if secure else 'http'}://{browser_address(host)}:{port}"
    _say(f"open {address}/?token={token} in a browser; Ctrl-C here ends it")
    if source == "webxr" and not is_public(host):
        _say(f"1. connect the headset by USB  2. run: adb reverse tcp:{port} tcp:{port}  3. open that address in it")
    elif source == "webxr":
        _say("1. join the same network  2. open that address in the headset  3. go on past the certificate's warning")
    if source == "ws":
        _say(f"messages go to {address.replace('http', 'ws', 1)}/hand?token={token}")
    if isinstance(frames, Datagrams):
        _say(f"messages go to {frames.name}")
    if is_public(host):
        _say(f"warning: anyone who can reach this computer at {host} and knows the token can watch and control it")
    if is_public(host) and isinstance(frames, Datagrams):
        _say("warning: UDP has no token: anyone who can reach that port can control the hand")


def _say(text: str) -> None:
    """To the terminal; standard output is for the timing."""
    print(text, file=sys.stderr, flush=True)


def main(arguments: list[str]) -> int:
    """Run the command with these arguments; the exit status: 0, or 2 for input that cannot be used."""
    try:
        run = parsed(lambda: tyro.cli(later(live), prog="mjx-hand live", args=arguments))
        enable_compile_cache()
        run()
    except InputError as error:
        _say(f"mjx-hand: {error}")
        return 2
    return 0


def command_line() -> int:
    """The command, with this process's arguments; the exit status."""
    return main(sys.argv[1:])

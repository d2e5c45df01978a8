"""The page in a headless Chromium: it draws the twin, keys reach it, an emulated headset's hand closes its fingers."""

import contextlib
import json
import shutil
import subprocess
import tarfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float
from websockets.sync.client import connect

from envs.live.session import Session, serving
from envs.live.sources.mailbox import Mailbox
from envs.live.twin.hinge_keypoints import hinge_keypoints
from envs.live.twin.tabletop import tabletop
from mjx_hand.capture.keypoints.layouts import LAYOUTS, from_keypoints
from mjx_hand.hand.joints import LINKS
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from tests.envs.live.test_server import Served
from tests.view.browser.chromium import Page, find_chromium, page

TOKEN, IWER = "0123456789abcdef", "iwer@2.5.0"
WEBXR = LAYOUTS["webxr"]
EMULATED = Path(__file__).with_name("emulated_headset.js")


@contextlib.contextmanager
def live(folder: Path) -> Iterator[Session]:
    """A headset's hand and its twin, served."""
    with serving(Mailbox("headset"), tabletop("pinch"), "right", TOKEN, folder=folder) as session:
        yield session


def url(session: Session) -> str:
    return f"http://localhost:{session.server.port}/?token={TOKEN}"


def twin(session: Session) -> Float[np.ndarray, "17 7"]:
    """The twin's links and its object, now."""
    with connect(f"ws://127.0.0.1:{session.server.port}/view?token={TOKEN}") as ws:
        while True:
            message = ws.recv(timeout=30)
            if isinstance(message, bytes):
                return np.frombuffer(message[8:], np.float32).reshape(17, 7)


def hand_at(bend: float) -> dict[str, list[float]]:
    """WebXR's joints of a right hand in front of its wearer, by name; metacarpals, which do not count, anywhere."""
    angles = bend * np.array([0.0, 1.0, 1.0, 0.7] * 5)[None]
    rigid = build_rigid_hand(load_hand())
    points = hinge_keypoints(angles, np.array([[0.2, 1.2, -0.4]]), np.array([[1.0, 0, 0, 0]]), rigid)[0]
    joints = np.nan_to_num(from_keypoints(points, WEBXR), nan=1.0)
    return dict(zip(WEBXR.joints, joints.tolist(), strict=True))


def run(opened: Page, script: str) -> object:
    found = opened.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True, userGesture=True)
    assert "exceptionDetails" not in found, found
    return found["result"].get("value")


def until(opened: Page, script: str, seconds: float = 30.0) -> None:
    deadline = time.monotonic() + seconds
    while not run(opened, script):
        assert time.monotonic() < deadline, run(opened, "document.getElementById('panel').innerText")
        time.sleep(0.1)


def enter(opened: Page, url: str, *scripts: str) -> None:
    """The page with scripts before its own, and its headset entered."""
    opened.call("Page.enable")
    for script in scripts:
        opened.call("Page.addScriptToEvaluateOnNewDocument", source=script)
    opened.call("Page.navigate", url=url)
    until(opened, "!!document.getElementById('enter') && !document.getElementById('enter').hidden")
    run(opened, "document.getElementById('enter').click()")


def tip_gap(links: Float[np.ndarray, "17 7"]) -> float:
    """Between the last links of thumb and index finger (m)."""
    return float(np.linalg.norm(links[LINKS.index("thumb3"), :3] - links[LINKS.index("index3"), :3]))


def chromium() -> str:
    found = find_chromium()
    if found is None:
        pytest.skip("no Chromium here to look at the page with")
    return found


def test_an_emulated_hand_closes_the_twins_fingers_and_the_page_draws_them(tmp_path):
    with live(tmp_path) as session, page(chromium(), "about:blank", tmp_path / "profile") as opened:
        names = json.dumps(WEBXR.joints)
        flat = f"emulated.names = {names}; emulated.joints = {json.dumps(hand_at(0.1))};"
        enter(opened, url(session), EMULATED.read_text() + flat)
        until(opened, "document.getElementById('state').textContent.includes('following')")
        before = twin(session)
        run(opened, f"emulated.joints = {json.dumps(hand_at(0.9))}; 0")
        time.sleep(1.5)
        after = twin(session)
        middle = LINKS.index("middle3")
        assert after[middle, 2] < before[middle, 2] - 0.03  # the palm is down: fingers that close go down
        np.testing.assert_allclose(after[0, :3], before[0, :3], atol=0.01)
        run(opened, "emulated.joints = null; 0")
        until(opened, "document.getElementById('state').textContent.includes('not seen')")
        np.testing.assert_allclose(twin(session)[:16, :3], after[:16, :3], atol=5e-3)
        colours = opened.picture().reshape(-1, 3).astype(int)
        assert ((colours[:, 0] > colours[:, 2] + 25).mean()) > 0.002  # skin and cube are drawn
        for state in ("on", ""):
            run(opened, "dispatchEvent(new KeyboardEvent('keydown', {key: 'r'})); 0")
            until(opened, f"document.getElementById('record').className === '{state}'")
        until(opened, "document.getElementById('notice').textContent.includes('live-001.npz')")
    assert (tmp_path / "live-001.npz").is_file()
    report = session.timing.report()
    assert report["stages_ms"]["picture"]["count"] > 0
    assert report["counts"]["refused"] == 0


def test_a_browser_without_webxr_is_told_so(tmp_path):
    browser = chromium()  # before there is a server that a skipped test would leave behind
    made = Served()
    with page(browser, "about:blank", tmp_path / "profile") as opened:
        opened.call("Page.enable")
        gone = "Object.defineProperty(navigator, 'xr', {value: undefined});"
        opened.call("Page.addScriptToEvaluateOnNewDocument", source=gone)
        opened.call("Page.navigate", url=f"http://localhost:{made.port}/?token={TOKEN}")
        until(opened, "document.getElementById('xr')?.textContent.includes('no WebXR')")
        assert run(opened, "document.getElementById('enter').hidden")
    made.server.stop()


@pytest.fixture(scope="session")
def iwer(tmp_path_factory) -> str:
    """Meta's Immersive Web Emulation Runtime (MIT), a script; npm brings it."""
    folder = tmp_path_factory.mktemp("iwer")
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip(f"no npm to fetch {IWER}, which emulates a headset")
    fetched = subprocess.run([npm, "pack", IWER], cwd=folder, capture_output=True, timeout=120, check=False)
    archives = list(folder.glob("*.tgz"))
    if fetched.returncode != 0 or not archives:
        pytest.skip(f"npm does not reach its registry for {IWER}, which emulates a headset")
    with tarfile.open(archives[0]) as archive:
        script = archive.extractfile("package/build/iwer.min.js")
        assert script is not None
        return script.read().decode()


def test_a_pinch_of_metas_emulator_closes_thumb_and_index_finger(tmp_path, iwer):
    with live(tmp_path) as session, page(chromium(), "about:blank", tmp_path / "profile") as opened:
        made = (
            "globalThis.device = new IWER.XRDevice(IWER.metaQuest3); device.installRuntime({forceInstall: true});"
            "device.primaryInputMode = 'hand'; device.hands.right.position.set(0.2, 1.2, -0.4);"
            "device.hands.left.connected = false;"
        )
        enter(opened, url(session), iwer + made)
        until(opened, "document.getElementById('state').textContent.includes('following')")
        before = tip_gap(twin(session))
        run(opened, "device.hands.right.updatePinchValue(1); 0")
        time.sleep(2)
        after = tip_gap(twin(session))
        assert before > 0.05
        assert after < 0.045
        assert after < 0.7 * before

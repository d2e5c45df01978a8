"""Make docs/figures/viewer.png: `mjx-hand view` of a demonstration, as a browser without a graphics card shows it.

Run from the checkout's root, with Chromium installed: python docs/figures/viewer.py DEMONSTRATION.npz [FRAME]
"""

import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from mjx_hand.cli.view import recording_scene
from mjx_hand.view.browser.viewer import serving
from tests.view.browser.chromium import find_chromium, page

OUT = Path(__file__).with_suffix(".png")
CLOSE = "document.querySelectorAll('.mantine-Notification-closeButton').forEach((button) => button.click())"


def main(demonstration: str, frame: int) -> None:
    """Write the picture."""
    chromium = find_chromium()
    if chromium is None:
        raise SystemExit("no Chromium; install it to take the picture")
    scene = recording_scene(Path(demonstration), None, None, None, "+z", None)
    with (
        serving(scene, port=0) as viewer,
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        page(chromium, viewer.url, Path(profile)) as opened,
    ):
        viewer.show(frame)
        time.sleep(20)  # without a graphics card the first frames take seconds each
        opened.call("Runtime.evaluate", expression=CLOSE)  # the note on software rendering
        time.sleep(5)
        Image.fromarray(opened.picture()).quantize(128).save(OUT, optimize=True)
    print(OUT)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 0)

"""Encoding raw frames as H.264 through the ffmpeg that imageio-ffmpeg brings."""

import contextlib
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import imageio_ffmpeg


@contextlib.contextmanager
def encoder(path: Path, width: int, height: int, fps: float) -> Iterator[Callable[[bytes], object]]:
    """A context in which `write(rgb)` takes each frame as height x width x 3 bytes; at its end the file is complete.

    Raises:
        RuntimeError: ffmpeg failed; the message ends with ffmpeg's own last line.
    """
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "-"]
    # yuv420p and the index at the front are what lets every browser play the file, before it is all there.
    target = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "23", "-preset", "veryfast", "-movflags", "+faststart"]
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", *source, *target, str(path)]
    # Not imageio_ffmpeg.write_frames: it starts ffmpeg through fork(), which may deadlock under JAX's threads.
    with tempfile.TemporaryFile() as messages:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=messages, process_group=0)
        assert process.stdin is not None
        try:
            with contextlib.suppress(BrokenPipeError), process.stdin:
                yield process.stdin.write
        finally:
            process.wait()
        if process.returncode:
            messages.seek(0)
            lines = messages.read().decode(errors="replace").strip().splitlines() or ["no message"]
            raise RuntimeError(f"ffmpeg failed with status {process.returncode}: {lines[-1]}")

"""Encode videos: frames are piped to ffmpeg, a separate program, which writes an MP4, GIF or WebP file.

Callers use `video`. It provides a `VideoEncoder` to send frames to, which writes beside the final path, and moves the
finished file there if everything has succeeded. Frames are encoded one by one, so that memory does not grow with their
number; only WebP with alpha keeps all frames, compressed, until the last. ffmpeg comes with the package imageio-ffmpeg.
"""

import errno
import logging
import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from depthwalk.files import replacing
from depthwalk.types import Picture

log = logging.getLogger(__name__)

_PATIENCE = 5  # seconds to wait for the last messages of an encoder that has ended
_CRF = 18  # x264's quality; visually lossless
_WEBP_QUALITY = 90  # per cent
_GIF_FPS = 50  # delays of GIF are hundredths of a second, and browsers show one as ten
# A palette for each frame: one for all would be known only at the end.
_GIF_PALETTES = "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=sierra2_4a"
_FOR_EVER = ("-loop", "0")


def _ratio(fps: float) -> Fraction:
    """Return frames per second as the fraction that encoders need: 24000/1001 is not rounded."""
    return Fraction(fps).limit_denominator()


def _own_group() -> dict[str, Any]:
    """Return options of `Popen` for a process that Ctrl-C in a terminal does not reach, and that opens no window."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW}
    return {"process_group": 0}


def _encoding(suffix: str, size: tuple[int, int], fps: float, transparent: bool) -> list[str]:
    """Return the options of ffmpeg for the format with a `suffix`, and for frames of a `size` in the file."""
    if suffix == ".gif":
        rate = f"fps={_GIF_FPS}," if fps > _GIF_FPS else ""
        return ["-filter_complex", rate + _GIF_PALETTES, *_FOR_EVER]
    if suffix == ".webp":
        # The first writes only what differs, with faint traces of earlier frames; the second blends frames over others.
        codec = "libwebp_anim" if transparent else "libwebp"
        return ["-c:v", codec, "-quality", str(_WEBP_QUALITY), *_FOR_EVER]
    return ["-vf", f"scale={size[0]}:{size[1]}", "-c:v", "h264", "-pix_fmt", "yuv420p", "-crf", str(_CRF)]


class VideoEncoder:
    """Run an encoder that turns frames into an MP4 file (H.264), a GIF or a WebP file, as the ending of its name says.

    `video` makes one and reports its failures.
    """

    def __init__(
        self, path: Path, size: tuple[int, int], fps: float, scaled: tuple[int, int], transparent: bool
    ) -> None:
        """Start the encoder.

        Parameters
        ----------
        path
            The file that it writes.
        size
            (width, height) of the frames that are sent, pixels.
        fps
            Frames per second.
        scaled
            (width, height) of the frames in the file, pixels, in MP4 both even.
        transparent
            Whether frames have alpha.
        """
        import imageio_ffmpeg

        pixels = "rgba" if transparent else "rgb24"
        source = ["-f", "rawvideo", "-pix_fmt", pixels, "-s", f"{size[0]}x{size[1]}", "-r", str(_ratio(fps))]
        picture = _encoding(path.suffix.lower(), scaled, fps, transparent)
        program = [imageio_ffmpeg.get_ffmpeg_exe(), "-nostdin", "-y", "-v", "warning"]
        # Ctrl-C in a terminal reaches this program only, which then ends the encoder.
        self._process = subprocess.Popen(
            [*program, *source, "-i", "pipe:0", "-an", *picture, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            **_own_group(),
        )
        self._last_lines: deque[bytes] = deque(maxlen=10)  # in memory, since a file would not fit a full disk
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def send(self, frame: Picture) -> None:
        """Send the next `frame`, (H, W, 3 or 4) uint8 sRGB, row 0 at the top.

        Raises OSError if the encoder has ended.
        """
        assert self._process.stdin is not None
        self._process.stdin.write(np.ascontiguousarray(frame).data)

    def finish(self) -> str:
        """Wait until all frames that were sent are encoded.

        Returns
        -------
        str
            The error, in one line; "" if there was none.
        """
        with suppress(OSError):  # it has ended, and its status says why
            assert self._process.stdin is not None
            self._process.stdin.close()
        status = self._process.wait()
        self._listener.join(_PATIENCE)
        lines = [line.decode("utf-8", "replace").strip() for line in self._last_lines if line.strip()]
        if not status:
            for line in lines:
                log.info("video encoder: %s", line)
            return ""
        how = f"was ended by signal {-status}" if status < 0 else f"failed with status {status}"
        return f"the video encoder {how}" + (f": {lines[-1][:200]}" if lines else "")

    @property
    def disk_full(self) -> bool:
        """Return whether the encoder has ended since it found no space on the disk: ffmpeg returns −ENOSPC."""
        status = self._process.poll()
        return status is not None and status > 0 and status & 0xFF == 256 - errno.ENOSPC

    def end(self) -> None:
        """Stop the encoder if it still runs, and close the pipe to it. May be called more than once."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        with suppress(OSError):  # frames still in the pipe are lost with the encoder
            assert self._process.stdin is not None
            self._process.stdin.close()

    def _listen(self) -> None:
        """Collect the encoder's output in a thread: a full pipe would block it."""
        assert self._process.stderr is not None
        with self._process.stderr as lines:
            self._last_lines.extend(lines)


@contextmanager
def video(path: Path, size: tuple[int, int], fps: float, *, transparent: bool = False) -> Iterator[VideoEncoder]:
    """Provide an encoder that writes a video at `path`, which is complete when the `with` block ends.

    Parameters
    ----------
    path
        The file to write or replace: .mp4 (H.264), or .gif or .webp, which repeat for ever.
    size
        (width, height) of the frames, pixels. An odd side is scaled to the next even one in MP4, as the format demands,
        with a warning.
    fps
        Frames per second; of a GIF, at most 50 are kept.
    transparent
        Whether frames have alpha, which MP4 files do not keep, and GIF files as 0 or 1.

    Yields
    ------
    VideoEncoder
        Takes frames (H, W, 3), or (H, W, 4) with alpha, uint8, sRGB, through `send`.

    Raises
    ------
    OSError
        If the encoder fails or is killed, with the last line that it printed; `path` is then unchanged.
    """
    even = path.suffix.lower() not in (".gif", ".webp")
    width, height = (side + side % 2 * even for side in size)
    if (width, height) != size:
        log.warning("%s: the sides of a video are even; scaled to %d,%d", path, width, height)
    import imageio_ffmpeg

    # Find the encoder, and remember it, before a file appears: Ctrl-C during the search may be swallowed by it.
    imageio_ffmpeg.get_ffmpeg_exe()
    with replacing(path) as temporary:
        encoder = VideoEncoder(temporary, size, fps, (width, height), transparent)
        try:
            try:
                yield encoder
            except BrokenPipeError:  # the encoder has ended before its last frame
                raise _failure(encoder, encoder.finish() or "the video encoder ended early", path) from None
            if message := encoder.finish():
                raise _failure(encoder, message.replace(str(temporary), str(path)), path)
            if not temporary.is_file() or not temporary.stat().st_size:
                raise OSError(f"{path}: the video encoder wrote nothing")
        finally:
            encoder.end()


def _failure(encoder: VideoEncoder, message: str, path: Path) -> OSError:
    """Return the error that `encoder` has ended with a `message`, instead of writing the file `path`."""
    if encoder.disk_full:
        return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
    return OSError(f"{path}: {message}")

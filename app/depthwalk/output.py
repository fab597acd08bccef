"""Files that appear whole or not at all; pictures as PNG, JPEG, OpenEXR and MP4."""

import errno
import io
import logging
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError

if TYPE_CHECKING:  # writing a file needs no GL, and most commands write no OpenEXR
    import OpenEXR

    from depthwalk.headless import LinearImage

log = logging.getLogger(__name__)

_QUALITY = 95  # of JPEG, in per cent
_CRF = 18  # x264's quality; visually lossless
_STAGING = ".bake-"  # before the number of the process that makes the folder
_PATIENCE = 5  # seconds for the last words of an encoder that has ended
_STALE = 86_400  # seconds, after which what a process that is gone has left may be removed


def check_folder(path: Path) -> None:
    """Makes sure that `path` can be written, by a try: what a system forbids shows nowhere else. Raises InputError."""
    folder = path.parent
    try:
        if not folder.is_dir():
            raise InputError(f"{path}: the folder {str(folder)!r} does not exist")
        if path.is_dir():
            raise InputError(f"{path}: is a folder")
        with suppress(FileNotFoundError):
            os.lstat(_temporary(path))  # fails for names that no file can have
        tempfile.TemporaryFile(dir=folder).close()  # without a name: nothing stays where somebody interrupts
    except ValueError:  # a null character
        raise InputError(f"{path}: no file can have that name") from None
    except OSError as error:
        named = error.errno == errno.ENAMETOOLONG
        why = "the name is too long" if named else f"the folder {str(folder)!r} is not writable"
        raise InputError(f"{path}: {why}") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to; it takes the place of `path` at the end, or vanishes where an error is raised.

    The name ends like `path`: writers choose the format by it. What was written is on the disk before it takes the
    place of anything. Raises OSError where that fails.
    """
    temporary = _temporary(path)
    try:
        yield temporary
        with _about(path, temporary):
            _flush(temporary)
            os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):  # what went wrong is told already
            temporary.unlink(missing_ok=True)
        raise


def _temporary(path: Path) -> Path:
    return path.with_name(f".{os.getpid()}-{path.name}")


@contextmanager
def _about(path: Path, temporary: Path) -> Iterator[None]:
    """Names `path` in errors of the system, which name the temporary file or none."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename not in (None, str(temporary)):
            raise
        raise type(error)(error.errno, error.strerror, str(path)) from error


def _flush(path: Path) -> None:
    """Wait until a file is on the disk: some systems tell only then that it has no room. Raises OSError."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def staging_folder(folder: Path) -> "tempfile.TemporaryDirectory[str]":
    """Make a folder in `folder`, on the same disk, for files not finished yet; leaving it as a context removes it.

    First removes those that killed processes left there, see `remove_leftovers`. Raises OSError.
    """
    remove_leftovers(folder, (_STAGING,))
    return tempfile.TemporaryDirectory(prefix=f"{_STAGING}{os.getpid()}-", dir=folder)


def remove_leftovers(folder: Path, prefixes: tuple[str, ...] = (".", _STAGING)) -> None:
    """Remove what killed processes left unfinished in `folder`: files and folders named by us for a process that is
    gone, and a day old, since a disk may be shared with other machines. What cannot be removed stays.

    prefixes: what stands before the number of the process in their names.
    """
    ours = re.compile(rf"(?:{'|'.join(map(re.escape, prefixes))})(\d{{1,9}})-.+")
    with suppress(OSError):
        for path in folder.iterdir():
            if (match := ours.fullmatch(path.name)) and not _is_running(int(match[1])):
                with suppress(OSError):  # another process removes as well
                    if time.time() - path.lstat().st_mtime > _STALE:
                        shutil.rmtree(path) if path.is_dir() else path.unlink()


def _is_running(process: int) -> bool:
    """Whether there is such a process on this machine; False where that cannot be asked without ending it."""
    if os.name == "nt":  # there `os.kill` does kill
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # somebody else's
        return True
    return True


def png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """The PNG file of an sRGB picture (H, W, 3) or (H, W, 4), row 0 at the top."""
    return _picture_bytes(pixels, "PNG", compress_level=4)


def jpeg_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """The JPEG file of an sRGB picture (H, W, 3), row 0 at the top."""
    return _picture_bytes(pixels, "JPEG", quality=_QUALITY, subsampling="4:4:4")


def _picture_bytes(pixels: NDArray[np.uint8], form: str, **options: Any) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(stream, form, **options)
    return stream.getvalue()


def write_bytes(path: Path, data: bytes) -> None:
    """Writes a whole file. Raises OSError."""
    with replacing(path) as temporary, _about(path, temporary):
        temporary.write_bytes(data)


def write_exr(path: Path, image: "LinearImage") -> None:
    """R, G, B (linear), A and Z (metres along the view axis, +inf where nothing is), all float. Raises OSError."""
    import OpenEXR

    channels = {name: np.ascontiguousarray(image.colour[..., c]) for c, name in enumerate("RGBA")}
    channels["Z"] = np.ascontiguousarray(image.distance)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    save_exr(path, OpenEXR.File(header, channels))


def save_exr(path: Path, file: "OpenEXR.File") -> None:
    """Writes a whole OpenEXR file. Raises OSError."""
    with replacing(path) as temporary:
        try:
            file.write(str(temporary))
        except RuntimeError as error:  # so the binding calls what the system refuses
            raise OSError(str(error).replace(str(temporary), str(path))) from None


class VideoEncoder:
    """A running encoder that makes an MP4 (H.264) file of frames. Belongs to `video`, which tells where it fails."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float, scaled: tuple[int, int]) -> None:
        import imageio_ffmpeg

        source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", str(_ratio(fps))]
        picture = ["-vf", f"scale={scaled[0]}:{scaled[1]}", "-c:v", "h264", "-pix_fmt", "yuv420p", "-crf", str(_CRF)]
        program = [imageio_ffmpeg.get_ffmpeg_exe(), "-nostdin", "-y", "-v", "warning"]
        # Ctrl-C is for this program, which then ends the encoder.
        self._process = subprocess.Popen(
            [*program, *source, "-i", "pipe:0", "-an", *picture, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            **_own_group(),
        )
        self._said: deque[bytes] = deque(maxlen=10)  # the last lines; in no file, which a full disk would not take
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def send(self, frame: NDArray[np.uint8]) -> None:
        """Hand over the next frame (H, W, 3), sRGB, row 0 at the top. Raises OSError where the encoder has ended."""
        assert self._process.stdin is not None
        self._process.stdin.write(np.ascontiguousarray(frame).data)

    def finish(self) -> str:
        """Wait until all frames are encoded; return what went wrong, in one line, or nothing."""
        with suppress(OSError):  # it has ended, and its status says why
            assert self._process.stdin is not None
            self._process.stdin.close()
        status = self._process.wait()
        self._listener.join(_PATIENCE)
        said = [line.decode("utf-8", "replace").strip() for line in self._said if line.strip()]
        if not status:
            for line in said:
                log.info("video encoder: %s", line)
            return ""
        how = f"was ended by signal {-status}" if status < 0 else f"failed with status {status}"
        return f"the video encoder {how}" + (f": {said[-1][:200]}" if said else "")

    def end(self) -> None:
        """Stop the encoder, if it still runs, and let go of it."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        with suppress(OSError):  # frames that nobody takes any more
            assert self._process.stdin is not None
            self._process.stdin.close()

    def _listen(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as lines:
            self._said.extend(lines)


@contextmanager
def video(path: Path, size: tuple[int, int], fps: float) -> Iterator[VideoEncoder]:
    """An MP4 (H.264) file at `path`, which takes frames (H, W, 3) uint8, sRGB, through `send`.

    size: (width, height), pixels; an odd side is scaled to the next even one, as the format demands, with a warning.
    Raises OSError, with the last line of what the encoder said, where it fails or is killed; `path` then is as it was.
    """
    width, height = (side + side % 2 for side in size)
    if (width, height) != size:
        log.warning("%s: the sides of a video are even; scaled to %d,%d", path, width, height)
    with replacing(path) as temporary:
        encoder = VideoEncoder(temporary, size, fps, (width, height))
        try:
            try:
                yield encoder
            except BrokenPipeError:  # it has ended before its last frame
                raise OSError(f"{path}: {encoder.finish() or 'the video encoder ended early'}") from None
            if failure := encoder.finish():
                raise OSError(f"{path}: {failure.replace(str(temporary), str(path))}")
            if not temporary.is_file() or not temporary.stat().st_size:
                raise OSError(f"{path}: the video encoder wrote nothing")
        finally:
            encoder.end()


def _own_group() -> dict[str, Any]:
    """Options of `Popen` for a process that Ctrl-C in a terminal does not reach, and that opens no window."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW}
    return {"process_group": 0}


def _ratio(fps: float) -> Fraction:
    """Frames per second as encoders want it: 24000/1001 is not rounded."""
    return Fraction(fps).limit_denominator()

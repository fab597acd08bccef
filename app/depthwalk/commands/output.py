"""Describe where frames are written: to picture files, a video or stdout; check this, and write pictures there."""

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from depthwalk.cluster.store import check_url, is_url, read_head, write_url
from depthwalk.errors import InputError
from depthwalk.files import check_folder, temporary_folder, write_bytes
from depthwalk.pictures import KEY_BYTES, LinearImage, jpeg_bytes, png_bytes, stored_key, webp_bytes, write_exr
from depthwalk.types import Picture

JPEG = (".jpg", ".jpeg")
SUFFIXES = (".png", *JPEG, ".webp", ".exr", ".mp4", ".gif")
_VIDEOS = {".mp4": "video", ".gif": "GIF"}  # a .webp file may be a picture, too
_WEBP_SIDE = 16383  # pixels
_FRAME = re.compile(r"\{frame(?::(\d{1,2}))?\}")


@dataclass(frozen=True)
class Output:
    """Describe where frames are written.

    Attributes
    ----------
    name
        The option OUT as the user gave it: a file, a series of files with `{frame}`, or `-` for stdout.
    transparent
        Whether pixels that show nothing have alpha 0.
    """

    name: str
    transparent: bool = False

    @property
    def to_stdout(self) -> bool:
        """Return whether the picture goes to stdout."""
        return self.name == "-"

    @property
    def suffix(self) -> str:
        """Return the suffix that determines the format, in lower case."""
        return ".png" if self.to_stdout else Path(self.name).suffix.lower()

    @property
    def is_series(self) -> bool:
        """Return whether each frame has its own file."""
        return _FRAME.search(self.name) is not None

    def is_video(self, count: int) -> bool:
        """Return whether `count` frames become one file that shows them one after the other: MP4, GIF or WebP."""
        return self.suffix in _VIDEOS or (self.suffix == ".webp" and count > 1 and not self.is_series)

    @property
    def is_remote(self) -> bool:
        """Return whether the name is a URL."""
        return is_url(self.name)

    def target(self, frame: int) -> str:
        """Return the name, a file's or a URL, of frame number `frame`."""
        return _FRAME.sub(lambda match: str(frame).zfill(int(match[1] or 0)), self.name)

    def file(self, frame: int) -> Path:
        """Return the file of frame number `frame`, which must be on this machine."""
        return Path(self.target(frame))


def check_output(output: Output, frames: Sequence[int], has_path: bool, inputs: Sequence[Path]) -> None:
    """Check that frames can be written, before anything is rendered.

    Parameters
    ----------
    output
        Where the frames are written.
    frames
        The numbers of the frames.
    has_path
        Whether the camera moves, as in a video.
    inputs
        Files that must not be changed.

    Raises
    ------
    InputError
        If the output does not suit the frames, cannot be written, or would overwrite an input.
    """
    name = output.name
    if not name:
        raise InputError("-o: must not be empty; name a file, or - for a PNG on standard output")
    if output.suffix not in SUFFIXES:
        raise InputError(f"{name}: must end in {', '.join(SUFFIXES)}, or be - for a PNG on standard output")
    if braces := re.search(r"\{[^}]*\}", _FRAME.sub("", name)):
        raise InputError(f"{name}: {braces[0]} is unknown; {{frame}} and {{frame:4}} stand for the frame's number")
    if output.transparent and output.suffix in (*JPEG, ".mp4"):
        kind = _VIDEOS.get(output.suffix, "JPEG")
        raise InputError(f"{name}: --no-background: a {kind} has no alpha; write .png, .webp or .exr")
    if output.is_video(len(frames)):
        kind = _VIDEOS.get(output.suffix, "WebP animation")
        if not has_path:
            raise InputError(f"{name}: a {kind} needs --path or --turntable")
        if output.is_series:
            raise InputError(f"{name}: a {kind} is a single file; leave {{frame}} out of its name")
        if output.is_remote:
            raise InputError(f"{name}: a {kind} can only be written to this machine; a URL is for pictures")
    elif (count := len(frames)) > 1 and not output.is_series:
        remedy = "put {frame:4} into the name, or give --frames 1"
        raise InputError(f"{name}: {count} frames do not fit into one picture; {remedy}")
    if output.is_remote:
        check_url(output.target(0))
    elif not output.to_stdout:
        _check_files(output, frames, inputs)


def check_webp(output: Output, size: tuple[int, int], *, resumes: bool) -> None:
    """Raise InputError if the output is a WebP file that cannot be of this size, or that lacks the key to resume by."""
    if output.suffix == ".webp" and max(size) > _WEBP_SIDE:
        raise InputError(f"{output.name}: the sides of a WebP file have at most {_WEBP_SIDE} pixels")
    if output.suffix == ".webp" and output.is_series and resumes:
        raise InputError(f"{output.name}: --resume and --cluster cannot tell which WebP files are whole; write .png")


def _check_files(output: Output, frames: Sequence[int], inputs: Sequence[Path]) -> None:
    check_folder(output.file(0))
    resolve = cache(Path.resolve)  # a series of a million files has one folder
    files = [output.file(frame) for frame in (frames if output.is_series else [0])]
    taken = {path.resolve() for path in inputs} | {path.parent.resolve() / path.name for path in inputs}
    if hit := next((file for file in files if resolve(file.parent) / file.name in taken), None):
        raise InputError(f"{hit}: would overwrite an input file; choose another name")


def has_frame(output: Output, frame: int, key: str) -> bool:
    """Return whether the picture of a frame exists: its file, which is never half written, holds the frame's key.

    Parameters
    ----------
    output
        Where the frames are written.
    frame
        The number of the frame.
    key
        The key of the frame, 64 hex digits.

    Returns
    -------
    bool
        True if there is nothing to draw.

    Raises
    ------
    OSError
        If a file exists but cannot be read.
    """
    if output.is_remote:
        return stored_key(read_head(output.target(frame), KEY_BYTES)) == key
    try:
        with output.file(frame).open("rb") as file:
            return stored_key(file.read(KEY_BYTES)) == key
    except FileNotFoundError:
        return False


def write_still(picture: Picture | LinearImage, output: Output, frame: int, key: str = "") -> None:
    """Write a picture.

    Parameters
    ----------
    picture
        The picture, as `draw_frame` returns it.
    output
        Where the frames are written.
    frame
        The number of the frame.
    key
        The key of the frame, to be stored in the file, except in WebP; "" for none.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    if isinstance(picture, LinearImage):
        _write_linear(picture, output, frame, key)
        return
    if output.suffix == ".webp":
        encoded = webp_bytes(picture)
    else:
        encoded = (jpeg_bytes if output.suffix in JPEG else png_bytes)(picture, key)
    if output.to_stdout:
        sys.stdout.buffer.write(encoded)
    elif output.is_remote:
        write_url(output.target(frame), encoded)
    else:
        write_bytes(output.file(frame), encoded)


def _write_linear(picture: LinearImage, output: Output, frame: int, key: str) -> None:
    if not output.is_remote:
        write_exr(output.file(frame), picture, key)
        return
    with temporary_folder() as folder:  # OpenEXR writes only to files
        file = Path(folder) / "frame.exr"
        write_exr(file, picture, key)
        write_url(output.target(frame), file.read_bytes())

"""Compute keys of frames from everything that they are drawn from, so that an earlier run's frames can be reused."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import depthwalk
from depthwalk.bake.cache import sidecar
from depthwalk.commands.options import RepresentationName
from depthwalk.commands.output import Output
from depthwalk.commands.reports import input_files
from depthwalk.errors import InputError, missing_file
from depthwalk.provenance import commit
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import DepthImageAsset, MeshAsset, Scene


@dataclass(frozen=True)
class FrameKeys:
    """Compute the key of each frame of a walk through a scene.

    Attributes
    ----------
    scene
        A hash of everything that the frames have in common, see `frame_keys`.
    """

    scene: str

    def key(self, camera: Camera) -> str:
        """Return the key of the frame seen by `camera`, 64 hex digits."""
        text = f"{self.scene} {camera.position!r} {camera.target!r} {camera.fov!r} {camera.time!r}"
        return hashlib.sha256(text.encode()).hexdigest()


def frame_keys(
    scene: Scene,
    settings: Sequence[str],
    *,
    size: tuple[int, int],
    representation: RepresentationName,
    output: Output,
    sky: Path | None,
) -> FrameKeys:
    """Return the key generator for the frames of a scene.

    The keys depend on the bytes of every file that the scene uses, not on the files' names; on the version of this
    program; and on the options. They do not depend on the driver: pictures from different kinds of GPU differ only by
    occasional rounding.

    Parameters
    ----------
    scene
        The scene, with the render settings with which the frames are drawn.
    settings
        The --set options.
    size
        (width, height) of the pictures, pixels.
    representation
        How every object is drawn.
    output
        Where the pictures are written, which decides their format and background.
    sky
        The picture of the option --sky; None if it is not given. Its bytes count as a file of the scene.

    Returns
    -------
    FrameKeys
        Computes the keys.

    Raises
    ------
    InputError
        If a file of the scene cannot be read.
    """
    look = [size, str(representation), output.transparent, output.suffix]
    look += ["sky"] if sky is not None else []
    look += ["a row"] if scene.side_by_side else []
    text = json.dumps(
        {
            "program": [depthwalk.__version__, commit()],
            "files": [_digest(file) for file in _contents(scene)],
            "settings": [*settings],
            "render": scene.render.model_dump(mode="json"),
            "look": [repr(value) for value in look],
        },
        sort_keys=True,
    )
    return FrameKeys(hashlib.sha256(text.encode()).hexdigest())


def _contents(scene: Scene) -> list[Path]:
    """Return the files that determine a scene's appearance; depth images beside a mesh follow from the mesh."""
    derived = {sidecar(asset.mesh) for asset in scene.assets if isinstance(asset, MeshAsset)}
    derived |= {sidecar(asset.depth) for asset in scene.assets if isinstance(asset, DepthImageAsset)}
    return [file for file in input_files(scene, None) if file not in derived]


def _digest(file: Path) -> str:
    if not file.is_file():
        raise missing_file(file)
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror or error}") from None

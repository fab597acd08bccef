"""Compute keys of frames from everything that they are drawn from, so that an earlier run's frames can be reused."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import depthwalk
from depthwalk.bake.cache import sidecar
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


def frame_keys(scene: Scene, settings: Sequence[str], *look: object) -> FrameKeys:
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
    *look
        Anything else that affects the picture, of types whose `repr` is complete.

    Returns
    -------
    FrameKeys
        Computes the keys.

    Raises
    ------
    InputError
        If a file of the scene cannot be read.
    """
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


def given_sky(sky: Path | None) -> tuple[str, ...]:
    """Return what `look` must tell of the option --sky: that it is given, as the file counts among the scene's."""
    return () if sky is None else ("sky",)


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

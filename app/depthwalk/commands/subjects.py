"""Find what `depthwalk compare` should measure: meshes, and the mesh assets of scenes with their parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from depthwalk.bake.params import Axis, Coordinates, Layers, Method, ModelParams
from depthwalk.commands.baking import mesh_spec
from depthwalk.errors import InputError, as_given, foreign_name
from depthwalk.ingest.formats import SCENE_SUFFIXES
from depthwalk.resources import given_or_shipped
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset
from depthwalk.scene.schema import DpciParams


@dataclass(frozen=True, kw_only=True)
class Subject:
    """Describe a mesh that is compared with its depth images.

    Attributes
    ----------
    name
        Name of the mesh in the report.
    spec
        The mesh and how it is read.
    params
        How its depth images are baked.
    scene
        The scene file that names the mesh; None for a mesh that the user named.
    """

    name: str
    spec: MeshAsset
    params: ModelParams
    scene: Path | None


@dataclass(frozen=True, kw_only=True)
class Choices:
    """Hold the options of the command line; None stands for an option that is not given.

    Attributes
    ----------
    resolution, layers, method, parts, axis, coordinates
        Parameters of every bake, as in `ModelParams`; they replace those of a scene.
    texture, up, height
        How to read meshes that no scene describes: the file of their texture, the axis that points upward, and the
        height to which they are scaled, metres.
    """

    resolution: int | None = None
    layers: Layers | None = None
    method: Method | None = None
    parts: int | Literal["auto"] | None = None
    axis: Axis | None = None
    coordinates: Coordinates | None = None
    texture: Path | None = None
    up: str | None = None
    height: float | None = None


def find_subjects(files: Sequence[Path], roots: Sequence[Path], choices: Choices) -> list[Subject]:
    """Return the meshes to compare: the given mesh files, and the assets with `dpci` of the given scene files.

    Parameters
    ----------
    files
        Meshes and scene files.
    roots
        Folders in which the files, and those that they name, are looked up as well.
    choices
        The options of the command line.

    Returns
    -------
    list[Subject]
        The meshes, in the order of the files.

    Raises
    ------
    InputError
        If a scene or an option cannot be used.
    """
    for root in roots:
        if not root.is_dir():
            raise InputError(f"--asset-root {as_given(root)}: no such folder{foreign_name(root)}")
    subjects: list[Subject] = []
    for file in (_find(file, roots) for file in files):
        if file.suffix.lower() in SCENE_SUFFIXES:
            subjects += _of_scene(file, roots, choices)
        else:
            texture = choices.texture and _find(choices.texture, roots)
            spec = mesh_spec(file, texture, "z" if choices.up == "z" else "y", choices.height)
            params = _bake_params(DpciParams(), choices)
            subjects.append(Subject(name=str(file), spec=spec, params=params, scene=None))
    return subjects


def _of_scene(scene: Path, roots: Sequence[Path], choices: Choices) -> list[Subject]:
    for option in ("texture", "up", "height"):
        if getattr(choices, option) is not None:
            raise InputError(f"--{option}: is for mesh files; {scene} sets it for its own meshes")
    subjects = [
        Subject(name=f"{scene}: {asset.name}", spec=asset, params=_bake_params(asset.dpci, choices), scene=scene)
        for asset in load_scene(scene, roots).assets
        if isinstance(asset, MeshAsset) and asset.dpci is not None
    ]
    if not subjects:
        raise InputError(f"{scene}: none of its mesh assets has `dpci`")
    return subjects


def _bake_params(dpci: DpciParams, choices: Choices) -> ModelParams:
    """Return the parameters in a scene, with those replaced that are set in `choices`."""
    method = choices.method or dpci.method
    layers = choices.layers or (dpci.layers if method == "raycast" else 1)
    try:
        return ModelParams(
            resolution=choices.resolution or dpci.resolution,
            layers=layers,
            method=method,
            parts=choices.parts or dpci.parts,
            axis=choices.axis or dpci.axis,
            coordinates=choices.coordinates or dpci.coordinates,
        )
    except InputError as error:  # the scene was checked before, so the options do not fit
        raise InputError(f"--{error}") from None


def _find(path: Path, roots: Sequence[Path]) -> Path:
    """Return `path`, or the file of that name below the first asset root that has one, or the shipped one."""
    candidates = [path] if path.is_absolute() else [path, *(root / path for root in roots)]
    return next((candidate for candidate in candidates if candidate.is_file()), None) or given_or_shipped(path)

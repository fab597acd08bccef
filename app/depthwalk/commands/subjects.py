"""What `depthwalk compare` is given: meshes, and scenes whose meshes it takes with the settings they have there."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from depthwalk.bake.axis import Axis
from depthwalk.bake.baker import Layers, Method
from depthwalk.bake.parts import ModelParams
from depthwalk.commands.bake import mesh_spec
from depthwalk.errors import InputError
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset
from depthwalk.scene.schema import DpciParams

SCENE_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True)
class Subject:
    """A mesh to compare with the depth images baked as `params` say. name: in the report; scene: the file that names
    it, or None."""

    name: str
    spec: MeshAsset
    params: ModelParams
    scene: Path | None


@dataclass(frozen=True)
class Choices:
    """What the command line says, None where it says nothing. resolution, layers, method, parts, axis: of every bake,
    instead of what a scene says; texture, up, height: of meshes that no scene describes."""

    resolution: int | None
    layers: Layers | None
    method: Method | None
    parts: int | Literal["auto"] | None
    axis: Axis | None
    texture: Path | None
    up: str | None
    height: float | None


def find_subjects(files: Sequence[Path], roots: Sequence[Path], choices: Choices) -> list[Subject]:
    """The meshes among `files`, and those of the scenes among them that have depth images. Raises InputError.

    roots: folders in which files are looked for as well.
    """
    for root in roots:
        if not root.is_dir():
            raise InputError(f"--asset-root {root}: no such folder")
    subjects: list[Subject] = []
    for file in (_find(file, roots) for file in files):
        if file.suffix.lower() in SCENE_SUFFIXES:
            subjects += _of_scene(file, roots, choices)
        else:
            texture = choices.texture and _find(choices.texture, roots)
            spec = mesh_spec(file, texture, "z" if choices.up == "z" else "y", choices.height)
            subjects.append(Subject(str(file), spec, _bake_params(DpciParams(), choices), None))
    return subjects


def _of_scene(scene: Path, roots: Sequence[Path], choices: Choices) -> list[Subject]:
    for option in ("texture", "up", "height"):
        if getattr(choices, option) is not None:
            raise InputError(f"--{option}: {scene} says itself how its meshes are read")
    subjects = [
        Subject(f"{scene}: {asset.name}", asset, _bake_params(asset.dpci, choices), scene)
        for asset in load_scene(scene, roots).assets
        if isinstance(asset, MeshAsset) and asset.dpci is not None
    ]
    if not subjects:
        raise InputError(f"{scene}: none of its mesh assets has `dpci`")
    return subjects


def _bake_params(dpci: DpciParams, choices: Choices) -> ModelParams:
    """`dpci` with the choices laid over it."""
    method = choices.method or dpci.method
    layers = choices.layers or (1 if method == "six-view" else dpci.layers)
    try:
        return ModelParams(
            resolution=choices.resolution or dpci.resolution,
            layers=layers,
            method=method,
            parts=choices.parts or dpci.parts,
            axis=choices.axis or dpci.axis,
        )
    except InputError as error:  # a scene is checked already: the options do not fit
        raise InputError(f"--{error}") from None


def _find(path: Path, roots: Sequence[Path]) -> Path:
    """`path`, or the file of that name below the first asset root that has one."""
    candidates = [path] if path.is_absolute() else [path, *(root / path for root in roots)]
    return next((candidate for candidate in candidates if candidate.is_file()), path)

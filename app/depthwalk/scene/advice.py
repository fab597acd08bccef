"""Declare the file that `depthwalk advise` writes: what was quickest on a machine, by asset and size on the screen.

A scene names it by the key `advice`; `representation: auto` follows it.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from depthwalk.limits import MAX_ASSETS
from depthwalk.params import param
from depthwalk.scene.document import read_document
from depthwalk.scene.fields import FileParams, Version
from depthwalk.scene.validate import check_model

_MOST_SIZES = 64


class MeasuredParams(FileParams):
    """Hold the measurements of one representation at one size."""

    ms: float = param(..., "Time that one copy adds to a frame, milliseconds on that machine", ge=0, le=1e9)
    flip: float = param(..., "Mean FLIP against the mesh drawn with 16 samples per pixel", ge=0, le=1)


class SizeParams(FileParams):
    """Hold the results for an asset at one size on the screen."""

    pixels: float = param(..., "Height or width of the object, whichever is larger", unit="pixels", ge=1, le=1e5)
    mesh: bool = param(..., "Whether `auto` draws the mesh at this size, rather than the depth images")
    quickest: str = param(..., "The quickest of all representations that reach the wanted FLIP")
    measured: dict[str, MeasuredParams] = Field({}, description="Measurements by representation")


class AdviceFile(FileParams):
    """Describe a file of advice as it is written."""

    version: Version = param(..., "Version of the file format")
    renderer: str = param(..., "Name of the renderer, from the GL driver")
    want_flip: float = param(..., "The mean FLIP that was asked for", ge=0, le=1)
    assets: Annotated[
        dict[str, Annotated[list[SizeParams], Field(max_length=_MOST_SIZES)]], Field(max_length=MAX_ASSETS)
    ] = Field({}, description="Results at each size, by asset")


@dataclass(frozen=True, kw_only=True)
class Advice:
    """Hold how an asset is drawn best, by its size on the screen.

    Attributes
    ----------
    pixels
        (n,) height or width, whichever is larger, pixels, ascending; n ≥ 1.
    mesh
        (n,) whether its mesh is drawn at that size, rather than its depth images.
    """

    pixels: tuple[float, ...]
    mesh: tuple[bool, ...]


def load_advice(path: Path) -> dict[str, Advice]:
    """Read the advice file `path`; return the advice by asset, for assets with measurements.

    Raises InputError with one located line per mistake.
    """
    file, _ = check_model(read_document(path), AdviceFile)
    found = {}
    for name, sizes in file.assets.items():
        if sizes:
            ordered = sorted(sizes, key=lambda size: size.pixels)
            found[name] = Advice(
                pixels=tuple(size.pixels for size in ordered), mesh=tuple(size.mesh for size in ordered)
            )
    return found


def advice_text(renderer: str, want_flip: float, assets: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """Return the text of an advice file, JSON, as `load_advice` reads it.

    `assets` holds, by asset, the fields of `SizeParams` for each size.
    """
    values = {"version": 1, "renderer": renderer, "want_flip": want_flip, "assets": assets}
    checked = AdviceFile.model_validate(values).model_dump()
    return json.dumps(checked, indent=1, ensure_ascii=False) + "\n"

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
    """Hold what one representation took at one size."""

    ms: float = param(..., "What a copy adds to a frame, milliseconds of the machine", ge=0, le=1e9)
    flip: float = param(..., "Mean FLIP against the mesh with 16 samples a pixel", ge=0, le=1)


class SizeParams(FileParams):
    """Hold what was found for an asset at one size on the screen."""

    pixels: float = param(..., "Larger of height and width of the object", unit="pixels", ge=1, le=1e5)
    mesh: bool = param(..., "Whether `auto` draws its mesh, not its depth images")
    quickest: str = param(..., "The quickest representation of all that reach the wanted FLIP")
    measured: dict[str, MeasuredParams] = Field({}, description="By representation, what was measured")


class AdviceFile(FileParams):
    """Describe a file of advice as it is written."""

    version: Version = param(..., "Version of the file format")
    renderer: str = param(..., "The GL driver's name of what drew")
    want_flip: float = param(..., "The mean FLIP that was asked for", ge=0, le=1)
    assets: Annotated[
        dict[str, Annotated[list[SizeParams], Field(max_length=_MOST_SIZES)]], Field(max_length=MAX_ASSETS)
    ] = Field({}, description="By asset, what was found at each size")


@dataclass(frozen=True, kw_only=True)
class Advice:
    """Say how an asset is drawn best, by its size on the screen.

    Attributes
    ----------
    pixels
        (n,) the larger of height and width, pixels, rising; n ≥ 1.
    mesh
        (n,) whether its mesh is drawn at that size; else its depth images are.
    """

    pixels: tuple[float, ...]
    mesh: tuple[bool, ...]


def load_advice(path: Path) -> dict[str, Advice]:
    """Read the file of advice `path`: by asset, for those of which anything was measured.

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
    """Return the text of a file of advice, JSON, from which `load_advice` reads it.

    `assets` holds the fields of `SizeParams` of each size, by asset.
    """
    values = {"version": 1, "renderer": renderer, "want_flip": want_flip, "assets": assets}
    checked = AdviceFile.model_validate(values).model_dump()
    return json.dumps(checked, indent=1, ensure_ascii=False) + "\n"

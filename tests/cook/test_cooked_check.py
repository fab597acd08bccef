"""Files of cooked objects that shaders would follow out of their buffers are refused."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from depthwalk.cook.cook import CookOptions, cook_object
from depthwalk.cook.cooked_check import check_geometry, check_texture
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.virtual_texture import VirtualTexture
from shapes import bake, box


@pytest.fixture(scope="module")
def loaded() -> tuple[LodGeometry, VirtualTexture]:
    return cook_object(bake(box(1, 1, 1), 16, 1), CookOptions()).load()


def test_what_cooking_makes_is_in_order(loaded: tuple[LodGeometry, VirtualTexture]) -> None:
    check_geometry(loaded[0])
    check_texture(loaded[1])


GEOMETRY: dict[str, Callable[[Any], Any]] = {
    "vertices": lambda values: values[:-1],
    "texels": lambda values: values.astype(np.int32),
    "indices": lambda values: np.where(np.arange(len(values)) == 7, 65535, values).astype(values.dtype),
    "chunks": lambda values: values + np.array([0, 1 << 40]),
    "first": lambda values: values - 1,
    "count": lambda values: values + (1 << 62),
    "horizon": lambda values: values * np.nan,
    "error": lambda values: values - 1,
    "box_size": lambda values: values * np.float32(np.inf),
    "box_low": lambda values: values[:2],
}
TEXTURE: dict[str, Callable[[Any], Any]] = {
    "normals": lambda values: values[:-1],
    "colours": lambda values: values[:, :-1],
    "tints": lambda values: np.zeros((999, 1, 2), np.uint8),
    "palette": lambda values: values * np.float32(np.nan),
    "table": lambda values: values[..., 0],
    "first_rows": lambda values: [*values[:-1], 1 << 40],
    "last_mip_tier": lambda values: 99,
    "colour_level": lambda values: -1,
}


@pytest.mark.parametrize("name", GEOMETRY)
def test_geometry(loaded: tuple[LodGeometry, VirtualTexture], name: str) -> None:
    change: dict[str, Any] = {name: GEOMETRY[name](getattr(loaded[0], name))}
    with pytest.raises(ValueError, match=r"are .* of \(|out of range"):
        check_geometry(replace(loaded[0], **change))


@pytest.mark.parametrize("name", TEXTURE)
def test_texture(loaded: tuple[LodGeometry, VirtualTexture], name: str) -> None:
    change: dict[str, Any] = {name: TEXTURE[name](getattr(loaded[1], name))}
    with pytest.raises(ValueError, match=r"are .* of \(|out of range"):
        check_texture(replace(loaded[1], **change))

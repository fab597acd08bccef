"""Texture and texture coordinates in baked files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from baked_files import Parts, identical, refused, rewrite
from depthwalk.bake.file import read_baked, read_header, write_baked
from depthwalk.bake.images import BakedObject, DepthImage
from depthwalk.bake.model import BakedModel
from shapes import bake, checkers, globe, model_of, two_halves


@pytest.fixture(scope="module")
def textured() -> BakedObject:
    """A globe whose texture is finer than its images, so that they hold texture coordinates."""
    baked = bake(globe(checkers(256, 16)), resolution=64, layers=1)
    assert baked.texture is not None
    return baked


def test_texture_and_coordinates_are_read_as_they_were(tmp_path: Path, textured: BakedObject) -> None:
    path = tmp_path / "globe.dpci.exr"
    write_baked(path, model_of(textured))
    (read,) = read_baked(path).parts
    assert read.texture is not None and textured.texture is not None
    np.testing.assert_array_equal(read.texture, textured.texture)
    for before, after in zip(textured.images, read.images, strict=True):
        assert before.coordinates is not None and after.coordinates is not None
        assert identical(before.coordinates, after.coordinates)
    assert read_header(path)["depthwalk.version"] == 11  # which earlier programs ask to bake again


def test_every_part_of_a_model_has_its_texture(tmp_path: Path) -> None:
    model = two_halves(globe(checkers(256, 16)), resolution=64)
    plain = replace(model.parts[1], texture=None, images=tuple(map(without_coordinates, model.parts[1].images)))
    for parts in (model.parts, (model.parts[0], plain)):
        path = tmp_path / "halves.dpci.exr"
        write_baked(path, BakedModel(parts=parts))
        read = read_baked(path).parts
        for before, after in zip(parts, read, strict=True):
            assert (before.texture is None) == (after.texture is None)
            assert before.texture is None or identical(before.texture, after.texture)
            for one, other in zip(before.images, after.images, strict=True):
                assert (one.coordinates is None and other.coordinates is None) or identical(
                    one.coordinates, other.coordinates
                )


def without_coordinates(image: DepthImage) -> DepthImage:
    return replace(image, coordinates=None)


def test_all_colours_of_a_texture_survive(tmp_path: Path, textured: BakedObject) -> None:
    every = np.arange(256, dtype=np.uint8).reshape(16, 16)
    texture = np.stack([every, every[::-1], every.T], -1)
    path = tmp_path / "x.dpci.exr"
    write_baked(path, model_of(replace(textured, texture=texture)))
    read = read_baked(path).parts[0].texture
    assert read is not None
    np.testing.assert_array_equal(read, texture)


def test_texture_and_coordinates_belong_together(tmp_path: Path, textured: BakedObject) -> None:
    path = tmp_path / "globe.dpci.exr"
    write_baked(path, model_of(textured))
    whole = path.read_bytes()
    rewrite(path, lambda parts: [part for part in parts if part[0] != "texture"])
    refused(path, "other channels than it should")

    def bare(parts: Parts) -> Parts:
        return [(name, header, {k: v for k, v in channels.items() if k != "uv"}) for name, header, channels in parts]

    path.write_bytes(whole)
    rewrite(path, bare)
    refused(path, "other channels than it should")


def test_a_texture_holds_colours(tmp_path: Path, textured: BakedObject, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "globe.dpci.exr"
    write_baked(path, model_of(textured))

    def spoil(parts: Parts) -> Parts:
        for name, _, channels in parts:
            if name == "texture":
                channels["G"][0, 0] = np.nan
        return parts

    rewrite(path, spoil)
    refused(path, "do not match their checksum")
    monkeypatch.setattr("depthwalk.bake.file.channel_checksum", lambda parts: read_header(path)["depthwalk.checksum"])
    refused(path, "values that are no colours")

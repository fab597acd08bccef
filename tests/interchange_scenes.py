"""A scene with a textured, a mirrored and a coloured node, in FBX, COLLADA, 3D Studio, 3MF and OBJ files."""

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from fuzz.case import Files, write_files
from fuzz.dae_files import dae
from fuzz.fbx_files import fbx
from fuzz.small_scenes import Paint, Use, cube, obj
from fuzz.three_ds_files import three_ds
from fuzz.three_mf_files import three_mf

Writer = Callable[[list[Use], Files], Files]

WRITERS: dict[str, Writer] = {
    "fbx": fbx,
    "fbx-embedded": lambda uses, pictures: fbx(uses, pictures, embedded=True, version=7700),
    "fbx-text": lambda uses, pictures: fbx(uses, pictures, text=True),
    "fbx-text-embedded": lambda uses, pictures: fbx(uses, pictures, text=True, embedded=True),
    "dae": dae,
    "3ds": three_ds,
    "3mf": three_mf,
    "3mf-parts": lambda uses, pictures: three_mf(uses, pictures, parts=True),
}


def picture(alpha: int = 255) -> bytes:
    """Return a picture without any symmetry."""
    j, i = np.mgrid[:16, :16].astype(np.uint8)
    texels = np.stack([i * 15, j * 15, np.uint8(255) * (i > j), np.full_like(i, 255)], axis=-1)
    texels[:4, :8, 3] = alpha
    Image.fromarray(texels).save(file := io.BytesIO(), "PNG")
    return file.getvalue()


def scene() -> list[Use]:
    """Return a cube, and two wedges of a picture, one of them mirrored, and something of one colour."""
    box = replace(cube(), colours=None)
    places = box.positions * np.where(box.positions[:, :1] > 0, [1, 0.3, 1], 1.0)
    first, second, third = places[np.array(box.polygons)[:, :3]].transpose(1, 0, 2)
    normals = np.cross(second - first, third - first)
    wedge = replace(
        box, positions=places, normals=np.repeat(normals / np.linalg.norm(normals, axis=1)[:, None], 4, axis=0)
    )
    skin, red = Paint(name="skin", picture="skin.png"), Paint(name="red", colour=(0.8, 0.05, 0.02))
    return [
        Use(name="one", shape=box, paint=skin, moved=(0, 1, 0), turned=(10, 30, 0)),
        Use(name="two", shape=wedge, paint=skin, moved=(3, 1, 0), turned=(0, 20, 15), scaled=(-1, 1, 1)),
        Use(name="three", shape=wedge, paint=skin, moved=(-3, 1, 0), turned=(0, 20, 15), scaled=(1, 1.2, 0.7)),
        Use(name="four", shape=box, paint=red, moved=(0, 2.7, 1), turned=(0, 0, 45), scaled=(0.5, 0.3, 0.4)),
    ]


def written(folder: Path, kind: str, uses: list[Use], pictures: Files | None = None) -> Path:
    (inner := folder / kind).mkdir()
    return write_files(inner, (obj if kind == "obj" else WRITERS[kind])(uses, pictures or {}))

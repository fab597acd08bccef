"""Write small scenes as 3D Studio files."""

import math
import struct
from typing import Any

import numpy as np

from depthwalk.colour import srgb8_from_linear
from fuzz.case import Files
from fuzz.small_scenes import Y_FROM_Z, Paint, Use, distinct, fans


def three_ds(uses: list[Use], pictures: Files) -> Files:
    """Return a 3D Studio file with its pictures: triangles, their vertices divided; nodes are applied; z is up."""
    objects = b"".join(_ds_material(paint) for paint in distinct(uses)[1])
    for number, use in enumerate(uses):
        objects += _chunk(0x4000, f"node{number}\0".encode() + _chunk(0x4100, _ds_mesh(use)))
    main = _chunk(0x4D4D, _chunk(0x0002, struct.pack("<I", 3)) + _chunk(0x3D3D, objects))
    return {"scene.3ds": main, **pictures}


def _chunk(kind: int, content: bytes) -> bytes:
    return struct.pack("<HI", kind, 6 + len(content)) + content


def _ds_material(paint: Paint) -> bytes:
    def colour(kind: int, linear: Any) -> bytes:
        return _chunk(kind, _chunk(0x0011, bytes(srgb8_from_linear(np.array(linear)).tolist())))

    def percent(kind: int, part: float) -> bytes:
        return _chunk(kind, _chunk(0x0030, struct.pack("<h", round(100 * part))))

    content = _chunk(0xA000, paint.name.encode() + b"\0") + colour(0xA020, paint.colour)
    content += colour(0xA030, [paint.specular] * 3) + percent(0xA040, math.log2(paint.exponent) / 10)
    content += percent(0xA041, 1.0) + percent(0xA050, 1 - paint.opacity)
    if paint.picture:
        content += _chunk(0xA200, percent(0, 1)[6:] + _chunk(0xA300, paint.picture.encode() + b"\0"))
    return _chunk(0xAFFF, content)


def _ds_mesh(use: Use) -> bytes:
    shape, matrix = use.shape, np.linalg.inv(Y_FROM_Z) @ use.matrix
    corners = shape.positions[shape.vertex]
    if (turn := np.linalg.det(matrix[:3, :3])) < 0:  # stored as if it were not mirrored
        corners = corners * [-1, 1, 1]
    places = corners @ matrix[:3, :3].T + matrix[:3, 3]
    faces = fans(shape)
    content = _chunk(0x4110, struct.pack("<H", len(places)) + places.astype("<f4").tobytes())
    if shape.uv is not None:
        content += _chunk(0x4140, struct.pack("<H", len(places)) + shape.uv.astype("<f4").tobytes())
    content += _chunk(0x4160, matrix[:3].T.astype("<f4").tobytes())
    rows = np.column_stack([faces if turn > 0 else faces[:, ::-1], np.full(len(faces), 7)]).astype("<u2")
    group = (
        use.paint.name.encode() + b"\0" + struct.pack("<H", len(faces)) + np.arange(len(faces), dtype="<u2").tobytes()
    )
    return content + _chunk(0x4120, struct.pack("<H", len(faces)) + rows.tobytes() + _chunk(0x4130, group))

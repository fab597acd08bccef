"""Hold the mesh that a generator returns, and write it to a PLY file."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthwalk.files import write_bytes


@dataclass(frozen=True)
class Model:
    """Hold a coloured triangle mesh, Y up.

    Attributes
    ----------
    positions
        (V, 3) float32, metres; while a sculpture is being made, centimetres.
    faces
        (F, 3) int32, counter-clockwise seen from outside.
    colours
        (V, 3) float32, sRGB, 0 to 1.
    normals
        (V, 3) float32, unit vectors; None: whoever reads the mesh derives them from the faces.
    """

    positions: NDArray[np.float32]
    faces: NDArray[np.int32]
    colours: NDArray[np.float32]
    normals: NDArray[np.float32] | None = None

    def moved(self, offset: ArrayLike) -> "Model":
        """Return the model moved by `offset` (3,), in the unit of the model."""
        return replace(self, positions=(self.positions + np.asarray(offset, np.float32)).astype(np.float32))

    def scaled(self, factor: float) -> "Model":
        """Return the model scaled about the origin by `factor`."""
        return replace(self, positions=(self.positions * np.float32(factor)).astype(np.float32))

    def turned(self, axis: int, degrees: float) -> "Model":
        """Return the model turned by `degrees` about `axis` (0, 1, 2 = x, y, z).

        The turn is counter-clockwise for a viewer at the tip of the axis who looks at the origin.
        """
        u, v = (axis + 1) % 3, (axis + 2) % 3
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        matrix = np.eye(3)
        matrix[u, u], matrix[u, v], matrix[v, u], matrix[v, v] = c, -s, s, c
        normals = None if self.normals is None else (self.normals @ matrix.T).astype(np.float32)
        return replace(self, positions=(self.positions @ matrix.T).astype(np.float32), normals=normals)

    def painted(self, colours: ArrayLike) -> "Model":
        """Return the model in one colour (3,), or with a colour for each vertex (V, 3), sRGB; `colours` are clipped."""
        wanted = np.clip(np.asarray(colours, np.float32), 0, 1)
        return replace(self, colours=np.broadcast_to(wanted, self.positions.shape).astype(np.float32))

    def grounded(self) -> "Model":
        """Return the model moved so that its lowest point is at y = 0."""
        return self.moved([0, -self.positions[:, 1].min(), 0])


def merged(models: Iterable[Model]) -> Model:
    """Return one model that holds all `models` unchanged.

    Where some of them have normals, those of the others are derived from their faces.
    """
    parts = list(models)
    starts = np.cumsum([0] + [len(m.positions) for m in parts[:-1]])
    with_normals = any(m.normals is not None for m in parts)
    return Model(
        np.concatenate([m.positions for m in parts]).astype(np.float32),
        np.concatenate([m.faces + start for m, start in zip(parts, starts, strict=True)]).astype(np.int32),
        np.concatenate([m.colours for m in parts]).astype(np.float32),
        np.concatenate([vertex_normals(m) for m in parts]) if with_normals else None,
    )


def vertex_normals(model: Model) -> NDArray[np.float32]:
    """Return the unit normals of `model` (V, 3): its own or, without these, the area-weighted means over the faces."""
    if model.normals is not None:
        return model.normals
    a, b, c = (model.positions[model.faces[:, k]].astype(np.float64) for k in range(3))
    weighted = np.cross(b - a, c - a)
    corners, shares = model.faces.T.ravel(), np.tile(weighted, (3, 1))
    total = np.stack([np.bincount(corners, shares[:, k], len(model.positions)) for k in range(3)], axis=1)
    return (total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-20)).astype(np.float32)


def write_ply(path: Path, model: Model) -> None:
    """Write `model` to the file `path` as binary little-endian PLY.

    Positions are float32, as are normals where the model has them; colours are sRGB in 8 bits. Indices have 16 bits
    where these suffice.
    """
    names = ["x", "y", "z"] + (["nx", "ny", "nz"] if model.normals is not None else [])
    vertices = np.empty(
        len(model.positions), [(n, "<f4") for n in names] + [(n, "u1") for n in ("red", "green", "blue")]
    )
    reals = model.positions if model.normals is None else np.hstack([model.positions, model.normals])
    for k, name in enumerate(names):
        vertices[name] = reals[:, k]
    for k, name in enumerate(("red", "green", "blue")):
        vertices[name] = np.round(np.clip(model.colours[:, k], 0, 1) * 255)
    index, index_type = ("<u2", "ushort") if len(vertices) <= 1 << 16 else ("<i4", "int")
    faces = np.empty(len(model.faces), [("count", "u1"), ("index", index, 3)])
    faces["count"], faces["index"] = 3, model.faces
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {n}" for n in names] + [f"property uchar {n}" for n in ("red", "green", "blue")]
    header += [f"element face {len(faces)}", f"property list uchar {index_type} vertex_indices", "end_header"]
    write_bytes(path, ("\n".join(header) + "\n").encode() + vertices.tobytes() + faces.tobytes())

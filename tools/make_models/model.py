"""What a generator hands back, and how it is written."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthwalk.files import write_bytes


@dataclass(frozen=True)
class Model:
    """A coloured triangle mesh: metres, Y up.

    positions: (V, 3) float32.
    faces:     (F, 3) int32, counter-clockwise seen from outside.
    colours:   (V, 3) float32, 0–1, sRGB.
    normals:   (V, 3) float32, unit length, or None: then the reader derives them from the faces.
    """

    positions: NDArray[np.float32]
    faces: NDArray[np.int32]
    colours: NDArray[np.float32]
    normals: NDArray[np.float32] | None = None

    def moved(self, offset: ArrayLike) -> "Model":
        """Return it moved by `offset`, metres."""
        return replace(self, positions=(self.positions + np.asarray(offset, np.float32)).astype(np.float32))

    def scaled(self, factor: float) -> "Model":
        """Return it scaled about the origin."""
        return replace(self, positions=(self.positions * np.float32(factor)).astype(np.float32))

    def turned(self, axis: int, degrees: float) -> "Model":
        """Return it turned about an axis (0, 1, 2 = x, y, z), counter-clockwise seen from the tip of the axis."""
        u, v = (axis + 1) % 3, (axis + 2) % 3
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        matrix = np.eye(3)
        matrix[u, u], matrix[u, v], matrix[v, u], matrix[v, v] = c, -s, s, c
        normals = None if self.normals is None else (self.normals @ matrix.T).astype(np.float32)
        return replace(self, positions=(self.positions @ matrix.T).astype(np.float32), normals=normals)

    def painted(self, colours: ArrayLike) -> "Model":
        """With the colour (3,), or a colour per vertex (V, 3)."""
        wanted = np.clip(np.asarray(colours, np.float32), 0, 1)
        return replace(self, colours=np.broadcast_to(wanted, self.positions.shape).astype(np.float32))

    def grounded(self) -> "Model":
        """Return it moved so that its lowest point is at y = 0."""
        return self.moved([0, -self.positions[:, 1].min(), 0])


def merged(models: Iterable[Model]) -> Model:
    """One model that holds the parts unchanged. Where only some have normals, the others' are derived."""
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
    """(V, 3) float32 unit normals: the model's own, or the area-weighted mean over the faces."""
    if model.normals is not None:
        return model.normals
    a, b, c = (model.positions[model.faces[:, k]].astype(np.float64) for k in range(3))
    weighted = np.cross(b - a, c - a)
    corners, shares = model.faces.T.ravel(), np.tile(weighted, (3, 1))
    total = np.stack([np.bincount(corners, shares[:, k], len(model.positions)) for k in range(3)], axis=1)
    return (total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-20)).astype(np.float32)


def write_ply(path: Path, model: Model) -> None:
    """Binary little-endian PLY: float32 positions (and normals where the model has them), uchar sRGB colours."""
    names = ["x", "y", "z"] + (["nx", "ny", "nz"] if model.normals is not None else [])
    vertices = np.empty(
        len(model.positions), [(n, "<f4") for n in names] + [(n, "u1") for n in ("red", "green", "blue")]
    )
    reals = model.positions if model.normals is None else np.hstack([model.positions, model.normals])
    for k, name in enumerate(names):
        vertices[name] = reals[:, k]
    for k, name in enumerate(("red", "green", "blue")):
        vertices[name] = np.round(np.clip(model.colours[:, k], 0, 1) * 255)
    faces = np.empty(len(model.faces), [("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, model.faces
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {n}" for n in names] + [f"property uchar {n}" for n in ("red", "green", "blue")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    write_bytes(path, ("\n".join(header) + "\n").encode() + vertices.tobytes() + faces.tobytes())

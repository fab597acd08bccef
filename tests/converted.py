"""What a scene file shows, as triangles in the world, to compare it with the glTF file that it was made from."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import rotate
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.reader import read_soup
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset


def of_file(path: Path) -> NDArray[np.float64]:
    """The corners (F, 3, 3) of the triangles of a mesh file, in a fixed order."""
    soup = read_soup(path)
    return in_order(soup.positions[soup.faces])


def of_scene(path: Path) -> NDArray[np.float64]:
    """The corners (F, 3, 3) of all triangles of a scene file, in the same order."""
    scene = load_scene(path)
    shown = []
    for row, asset in enumerate(scene.objects.asset):
        source = scene.assets[asset]
        assert isinstance(source, MeshAsset)
        mesh = load_mesh(source.mesh)
        turned = rotate(scene.objects.rotation[row].astype(float), mesh.positions.astype(float))
        placed = scene.objects.position[row] + scene.objects.scale[row] * turned
        shown.append(placed[np.concatenate([mesh.faces, mesh.translucent_faces])])
    return in_order(np.concatenate(shown))


def volume(triangles: NDArray[np.float64]) -> float:
    """The volume within triangles (F, 3, 3), negative if they are inside out."""
    return float(np.linalg.det(triangles).sum() / 6)


def in_order(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangles (F, 3, 3), each beginning with the same corner wherever it was read from, in one order."""
    rounded = np.rint(triangles * 100).astype(np.int64)
    key = rounded[..., 0] * 1_000_003 + rounded[..., 1] * 1009 + rounded[..., 2]
    first = key.argmin(axis=1)
    turned = np.take_along_axis(triangles, ((first[:, None] + np.arange(3)) % 3)[:, :, None], axis=1)
    middle = np.rint(turned.mean(axis=1) * 100).astype(np.int64)
    return np.asarray(turned[np.lexsort([*middle.T, *np.rint(turned[:, 0] * 100).T])])

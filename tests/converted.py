"""What a scene file shows, as triangles in the world, to compare it with the glTF file that it was made from."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from depthwalk.geometry.quaternions import rotate
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.reader import read_soup
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset, show_moment


def of_file(path: Path) -> NDArray[np.float64]:
    """The corners (F, 3, 3) of the triangles of a mesh file."""
    soup = read_soup(path)
    return np.asarray(soup.positions[soup.faces])


def of_scene(path: Path, moment: float = 0.0) -> NDArray[np.float64]:
    """The corners (F, 3, 3) of all triangles of a scene file, at a moment, seconds."""
    scene = load_scene(path)
    show_moment(scene, moment)
    shown = []
    for row, asset in enumerate(scene.objects.asset):
        source = scene.assets[asset]
        assert isinstance(source, MeshAsset)
        mesh = load_mesh(source.mesh)
        turned = rotate(scene.objects.rotation[row].astype(float), mesh.positions.astype(float))
        placed = scene.objects.position[row] + scene.objects.scale[row] * turned
        shown.append(placed[np.concatenate([mesh.faces, mesh.translucent_faces])])
    return np.concatenate(shown)


def difference(shown: NDArray[np.float64], wanted: NDArray[np.float64]) -> float:
    """How far any triangle (F, 3, 3) is from the most similar one of the others, in place and in area × normal.

    Neither the order of triangles nor the corner with which one begins matters; the side that it shows does.
    """
    one, other = (_features(triangles) for triangles in (shown, wanted))
    return float(max(cKDTree(one).query(other)[0].max(), cKDTree(other).query(one)[0].max()))


def _features(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    edges = triangles[:, 1:] - triangles[:, :1]
    return np.concatenate([triangles.mean(axis=1), np.cross(edges[:, 0], edges[:, 1]) / 2], axis=1)

"""Only surfaces too large for their box are foliage, whatever their size; from within one sees the backs of leaves."""

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.geometry.adjacency import Shape
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.passes import dmesh
from depthwalk.render.resources.foliage import is_foliage
from depthwalk.render.view.view import view_distance
from depthwalk.scene.arrays import Representation
from shapes import ShapeLibrary, box, leaves, mesh_of, scene_of, sphere
from stage import OnScreen, view_of


def shape_of(mesh: Mesh, scale: float = 1.0) -> Shape:
    """Positions and triangles."""
    return (mesh.positions * scale).astype(np.float32), mesh.faces.astype(np.uint32)


@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
def test_leaves_are_foliage_and_solids_are_not(scale: float) -> None:
    assert is_foliage(shape_of(leaves(2000, 0.15), scale))
    assert not is_foliage(shape_of(leaves(40, 0.15), scale))  # few, each of which has a place of its own
    assert not is_foliage(shape_of(sphere(columns=32, rows=16), scale))
    assert not is_foliage(shape_of(box(0.8, 0.8, 0.8), scale))


def test_nothing_is_no_foliage() -> None:
    assert not is_foliage((np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)))


def closed(mesh: Mesh) -> Mesh:
    """A mesh with a back for each face, so that rays see only what faces them."""
    return mesh_of(mesh.positions, np.concatenate([mesh.faces, mesh.faces[:, ::-1]]), mesh.normals)


def covered(device: Device, mesh: Mesh, representation: Representation) -> float:
    """Share of the pixels that show the mesh, seen by a viewer at its centre who looks to four sides."""
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=representation)
    with OnScreen(device, scene, ShapeLibrary([mesh], resolution=32)) as stage:
        shares = []
        for x, z in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            stage.draw(view_of((0.0, 0.5, 0.0), (x, 0.5, z)), transparent=True)
            shares.append(stage.pixels().any(-1).mean())
    return float(np.mean(shares))


def test_from_within_leaves_show_their_backs_and_a_solid_does_not(gl_device: Device) -> None:
    crown = closed(leaves(2000, 0.15))
    mesh, images = (covered(gl_device, crown, kind) for kind in (Representation.MESH, Representation.DPCI))
    assert images > 0.9 * mesh > 0.8
    assert covered(gl_device, sphere(0.5, 64, 32), Representation.DPCI) == 0


def depths(device: Device) -> NDArray[np.float32]:
    """How far each pixel's surface is, in metres along the view axis, for a viewer at the centre of a crown."""
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.DPCI)
    crown = closed(leaves(400, 0.4))
    with OnScreen(device, scene, ShapeLibrary([crown], resolution=32)) as stage:
        view = view_of((0.0, 0.5, 0.0), (1.0, 0.5, 0.0))
        stage.draw(view)
        assert stage.renderer.targets is not None
        drawn = np.frombuffer(stage.renderer.targets.depth.read(alignment=1), np.float32)
        return view_distance(drawn, *view.depth_range)


def test_backs_are_behind_what_coincides_with_them(gl_device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else rounding would choose between the two sides of a leaf, pixel by pixel; here by 5 cm, to be told apart."""
    monkeypatch.setattr(dmesh, "BEHIND", 0.0)
    before = depths(gl_device)
    monkeypatch.setattr(dmesh, "BEHIND", 0.05)
    shown = np.isfinite(before)
    farther = depths(gl_device)[shown] - before[shown]
    assert farther.min() > -1e-3 and farther.max() < 0.051
    assert (np.abs(farther) < 1e-3).mean() > 0.2  # fronts
    assert (np.abs(farther - 0.05) < 1e-3).mean() > 0.2

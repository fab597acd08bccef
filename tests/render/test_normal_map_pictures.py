"""Normal maps in every representation, against analytic normals in the G-buffer."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.render.passes.mesh import MeshPass
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from normal_mapped import TILT, coded, dome_normals, domed_square, mirrored_globe, tilted, tilted_globe_normals
from shapes import ShapeLibrary, panes, scene_of
from stage import SIZE, Stage
from studio import Studio

pytestmark = pytest.mark.gl

POLYGONS = [Representation.MESH, Representation.MESH_LOD, Representation.MESH_CLUSTERS]
GREY = Material((0.6, 0.6, 0.6), specular=0.0)


def shown(representation: Representation) -> Scene:
    return scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=representation)


def seen(studio: Studio, mesh: Mesh, representation: Representation, camera: Camera) -> tuple[Array, Array]:
    """Points and normals of the G-buffer, (n, 3) each."""
    baked = None if representation is Representation.DPCI else [None]
    library = ShapeLibrary([mesh], baked, resolution=128)
    with Stage(studio, shown(representation), library, sun=False) as stage:
        stage.draw(View(camera, SIZE))
        points = stage.points()
        solid = points[..., 1] > -1e5
        return points[solid], stage.normals()[solid]


@pytest.mark.parametrize("representation", [*POLYGONS, Representation.DPCI])
@pytest.mark.parametrize("behind", [False, True])
def test_domes_on_a_square(studio: Studio, representation: Representation, behind: bool) -> None:
    """Seen from behind, an open mesh shows the opposite of its normals."""
    side = -1 if behind else 1
    camera = Camera((0.3, 1.2, 2.2 * side), (0.0, 1.0, 0.0), 0.95)
    points, normals = seen(studio, domed_square(256, 3), representation, camera)
    expected, smooth = dome_normals((points[:, 0] + 1) / 2, points[:, 1] / 2, 3)
    assert len(points) > 10_000 and smooth.mean() > 0.7
    error = np.degrees(np.arccos(np.clip(np.sum(side * expected * normals, 1), -1, 1)))[smooth]
    assert np.median(error) < 0.7
    assert np.quantile(error, 0.95) < (2.5 if representation is Representation.DPCI else 1.5)


@pytest.mark.parametrize("representation", [*POLYGONS, Representation.DPCI])
@pytest.mark.parametrize("azimuth", [0.4, 3.6])
def test_a_mirrored_texture_on_a_globe(studio: Studio, representation: Representation, azimuth: float) -> None:
    camera = Camera((4 * np.sin(azimuth), 1.6, 4 * np.cos(azimuth)), (0.0, 1.0, 0.0), 0.6)
    points, normals = seen(studio, tilted(mirrored_globe()), representation, camera)
    outward = points - [0, 1, 0]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    regular = (np.abs(outward[:, 0]) > 0.1) & (np.abs(outward[:, 1]) < 0.9)
    assert regular.sum() > 5_000
    error = np.linalg.norm(normals - tilted_globe_normals(outward), axis=1)[regular]
    assert np.median(error) < 0.03
    assert np.quantile(error, 0.99) < 0.1


def test_multisampling_keeps_the_frame(studio: Studio) -> None:
    """Its samples at edges are extrapolated for derivatives, and centred for looking up."""
    plain, sampled = (middle_picture(studio, domed_square(256, 3), aa) for aa in ("none", "msaa"))
    assert np.abs(plain - sampled).mean() < 0.01


def middle_picture(studio: Studio, mesh: Mesh, antialiasing: str) -> Array:
    scene = shown(Representation.MESH)
    scene.render.aa = antialiasing  # type: ignore[assignment]
    return studio.picture(scene, ShapeLibrary([mesh], [None]), Camera((0.3, 1.2, 2.2), (0.0, 1.0, 0.0), 0.95))


def picture(studio: Studio, mesh: Mesh) -> Array:
    scene = scene_of(
        (0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=Representation.MESH, sun={"direction": (-1, -0.2, -1)}
    )
    return studio.picture(scene, ShapeLibrary([mesh], [None]), Camera((0.0, 1.0, 4.0), (0.0, 1.0, 0.0), 0.4))


def tilted_pane(scale: float = 1.0, **looks: Any) -> Mesh:
    """A pane that faces +z, of a map that tilts its normal."""
    texels = coded(np.broadcast_to(TILT, (2, 2, 3)))
    return panes((0.0, replace(GREY, normal_map=texels, normal_scale=scale, **looks)))


@pytest.mark.parametrize("scale", [1.0, 0.3, -1.0])
def test_glass_is_lit_as_an_opaque_pane_is(studio: Studio, scale: float) -> None:
    """With an opacity just below that of an opaque one."""
    opaque, glass, flat = (
        picture(studio, mesh)
        for mesh in (tilted_pane(scale), tilted_pane(scale, opacity=0.985), tilted_pane(0.0, opacity=0.985))
    )
    middle = slice(50, 70), slice(70, 90)
    assert glass[middle] == pytest.approx(opaque[middle], abs=4 / 255)
    assert np.abs(glass[middle] - flat[middle]).max() > 0.02


def test_panes_with_and_without_a_map_are_blended_in_their_order(studio: Studio) -> None:
    bare = replace(GREY, opacity=0.5)
    texels = coded(np.broadcast_to(TILT, (2, 2, 3)))
    mapped = replace(bare, normal_map=texels)
    no_effect = replace(mapped, normal_scale=0.0)
    plain = picture(studio, panes((0.0, bare), (0.5, bare), (1.0, bare)))
    mixed = picture(studio, panes((0.0, bare), (0.5, no_effect), (1.0, bare)))
    assert mixed == pytest.approx(plain, abs=1.5 / 255)
    assert np.abs(picture(studio, panes((0.0, bare), (0.5, mapped), (1.0, bare))) - plain).max() > 0.02


def test_a_map_costs_meshes_without_one_nothing(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are drawn by the programs they had before there were maps."""
    used: list[set[tuple[str, ...]]] = []
    draw = MeshPass._draw

    def noted(self: MeshPass, frame: Any) -> None:
        draw(self, frame)
        used.append(set(self._programs))

    monkeypatch.setattr(MeshPass, "_draw", noted)
    for mesh in (mirrored_globe(), domed_square(16, 2)):
        picture(studio, mesh)
    assert used == [{()}, {("PAINTED", "NORMAL_MAP")}]


def test_textures_are_freed_with_their_mesh(studio: Studio) -> None:
    before = dict(studio.device.live)
    for mesh in (domed_square(16, 2), tilted_pane(opacity=0.5)):
        picture(studio, mesh)
    assert studio.device.live == before

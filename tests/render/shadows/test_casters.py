"""Meshes that cast shadows in the stead of depth images, whose texels maps would show."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.model import BakedModel
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import MeshLevel
from depthwalk.render.lod.fallback_rule import MeshFallbackRule
from depthwalk.render.shadows.cascades import Cascade, light_axes
from depthwalk.render.shadows.casters import shadow_map
from depthwalk.render.shadows.spot_maps import Spot
from depthwalk.scene.arrays import Representation
from depthwalk.types import Array, Mask, Rows
from shapes import ShapeLibrary, bake, leaves, scene_of, sphere, two_halves
from stage import NEAR, SlowLibrary, Stage, Walk, draws_until, view_of
from studio import Studio

TO_SUN = np.array([0.5, 0.8, 0.3])
GROUND = {"ground": {"height": 0.0}, "sun": {"direction": tuple(-TO_SUN)}}
AUTO = Representation.AUTO
TREE, BALL = (0, (-0.8, 0.5, 0), 0.3, 1.5), (1, (1.2, 0, 0.4), 2.0, 1.0)
FAR = (1, (0, 0, 400.0), 0.0, 1.0)  # so that shadows go on beyond all maps


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    """A tree of 800 triangles, whose leaves are two texels long, and a ball in two parts."""
    meshes = [leaves(400, 0.12), sphere(0.5, columns=16, rows=8)]
    return ShapeLibrary(meshes, [bake(meshes[0], 48, 2), two_halves(meshes[1])])


def casts(
    studio: Studio, library: ShapeLibrary, representation: Representation, magnification: float
) -> tuple[Array, list[tuple[int, int]]]:
    """The nearest map (H, W), and how many depth objects and meshes each map holds."""
    scene = scene_of(TREE, BALL, FAR, representation=representation, **GROUND)
    scene.render.lod.magnification, scene.render.shadows.triangles_per_texel = magnification, 1e6
    with Stage(studio, scene, library) as stage:
        stage.draw(view_of())
        held = [(len(each.grids.records), len(each.meshes.records)) for each in stage.shadow_maps()]
        return stage.maps()[0][1], held


def test_meshes_cast_what_images_would_only_magnify(studio: Studio, library: ShapeLibrary) -> None:
    """Each once, where it stands."""
    wanted, _ = casts(studio, library, Representation.MESH, 1.0)
    standing, held = casts(studio, library, Representation.DPCI, 0.01)
    assert held == [(0, 2)] * 3
    images, held = casts(studio, library, Representation.DPCI, 0.0)
    assert held == [(3, 0)] * 3
    off, images_off = ((np.abs(depth - wanted) > 1e-4).sum() for depth in (standing, images))
    assert images_off > 1000 and off < 0.03 * images_off  # quaternions round


@pytest.mark.parametrize(("told", "fewer"), [(8, True), (None, False), (10**6, False)])
def test_meshes_of_few_triangles_cast_where_more_frames_follow(
    gl_device: Device, library: ShapeLibrary, told: int | None, fewer: bool
) -> None:
    """If files tell how few, and the object is drawn by `auto`."""
    images = replace(bake(sphere(0.5, columns=16, rows=8), 32, 1), mesh_triangles=told)
    own = ShapeLibrary([library.mesh(1)], [BakedModel(parts=(images,))])
    for kind, remembers in (AUTO, True), (AUTO, False), (Representation.DPCI, True):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=kind, **GROUND)
        scene.render.lod.magnification, scene.render.shadows.enabled = 1000.0, True
        with Walk(gl_device, scene, own, seconds=None) as walk:
            walk.renderer.remembers = remembers
            walk.look(NEAR)
            assert walk.counts["shadow_maps"] == 3
            assert (walk.counts["shadow_triangles"] == 0) == (fewer and kind is AUTO and remembers)


def all_have(meshes: Rows) -> Mask:
    return np.ones(len(meshes), bool)


@pytest.mark.parametrize("kind", ["sun", "lamp"])
def test_limits_are_texels_and_triangles(studio: Studio, library: ShapeLibrary, kind: str) -> None:
    """Ever finer maps of the tree: a mesh casts as soon as a texel of the images covers two, and never where it has
    more triangles for its texels than images may have."""
    with Stage(studio, scene_of(TREE), library) as stage:
        placed = stage.renderer.world
        scene, table = placed.arrays(), placed.table()
        mesh = library.mesh(0)
        assert mesh is not None
        table.meshes.add(0, [MeshLevel(mesh, 0.0)])
        finest = 0.0
        for resolution in range(64, 1024, 32):
            view: Cascade | Spot = Cascade(
                centre=(0.0, 1.0, 0.0), half=3.0, axes=light_axes(TO_SUN), resolution=resolution
            )
            if kind == "lamp":
                view = Spot(
                    centre=(-0.8, 20.0, 0.0),
                    axes=light_axes(np.array([0.0, 1.0, 0.01])),
                    angle=0.7,
                    reach=40.0,
                    resolution=resolution,
                )
            nearest, middle = (float(texel[0]) for texel in view.texels(placed.bounds()))
            magnified = 1.5 * float(table.mesh_fallbacks.texel[placed.objects().asset[0]]) / nearest > 2.0
            texels = 4 * table.cylinder_radius[0] * table.half_height[0] * (1.5 / middle) ** 2
            for triangles, stands_in in ((801, magnified), (799, False)):
                rule = MeshFallbackRule(
                    magnification=2.0, is_resident=all_have, error=0.125, triangles_per_pixel=triangles / texels
                )
                drawn = shadow_map(view, np.array([0]), scene, rule)
                assert (len(drawn.grids.records), len(drawn.meshes.records)) == (1 - stands_in, stands_in)
            finest += magnified
    assert 3 < finest < 27


def test_a_walk_does_not_wait_for_meshes_that_cast(gl_device: Device) -> None:
    """Images do until they have come; then the maps are drawn again, once."""
    ball = sphere(0.5, columns=16, rows=8)
    library, scene = SlowLibrary([ball], [bake(ball, resolution=32, layers=1)]), scene_of((0, (0, 0, 0), 0.0, 1.0))
    scene.render.shadows.enabled, scene.render.lod.magnification = True, 0.01
    with Walk(gl_device, scene, library, seconds=0.01) as walk:
        walk.look(NEAR)
        assert walk.counts["shadow_maps"] == 2 and walk.counts["shadow_triangles"] > 0  # the second holds all shadows
        walk.look(NEAR)
        assert walk.counts["shadow_maps"] == 0
        library.may.set()
        draws_until(walk, lambda: walk.counts["shadow_maps"] > 0)
        assert walk.counts["shadow_maps"] == 2 and walk.counts["shadow_triangles"] == 0
        walk.look(NEAR)
        assert walk.counts["shadow_maps"] == 0

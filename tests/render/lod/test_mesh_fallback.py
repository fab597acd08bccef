"""Meshes in the stead of depth images whose texels would be seen."""

import threading
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import depthwalk.render.draw.object_detail
import depthwalk.render.lod.fallback_rule
import depthwalk.render.lod.mesh_lod
from depthwalk.bake.meso import Meso
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.view.bounds import outside
from depthwalk.render.view.view import View
from depthwalk.render.world.frame_residency import FrameResidency
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.render_settings import DEFAULT_BUDGET
from depthwalk.types import Array
from shapes import ShapeLibrary, bake, box, joined, scene_of, sphere, two_halves
from stage import AWAY, NEAR, SlowLibrary, Walk, draws_until
from studio import Studio

SIZE = 160, 120


@pytest.fixture(scope="module")
def ball() -> Mesh:
    return sphere(0.5, columns=16, rows=8)


@pytest.fixture(scope="module")
def dense() -> Mesh:
    """More than 9,000 triangles."""
    return sphere(0.5, columns=96, rows=48)


def asset_of(kind: str, ball: Mesh) -> tuple[Mesh, BakedModel]:
    """A mesh and its depth images: upright, lying and beside its origin, or in two parts."""
    if kind == "parts":
        return ball, two_halves(ball, 64)
    mesh = joined(box(1.0, 0.4, 0.4, (0.6, 0.2, 0)), box(0.3, 1.0, 0.3, (1.0, 0.7, 0.2), colour=(60, 90, 200)))
    return mesh, bake_model(
        mesh, ModelParams(resolution=64, layers=2, axis="y" if kind == "upright" else (1.0, 2.0, -0.5)), ""
    )


def pictures(
    studio: Studio,
    scene: Sequence[tuple[int, tuple[float, float, float], float, float]],
    library: ShapeLibrary,
    camera: Camera,
    **settings: float,
) -> tuple[Array, Array, dict[str, float]]:
    """As depth images with `magnification`, and as meshes, with the counts of the former."""
    near, far = scene_of(*scene), scene_of(*scene, representation=Representation.MESH)
    for name, value in settings.items():
        setattr(near.render.lod, name, value)
    pixels, _, plan = studio.measured(near, library, camera, size=SIZE)
    return pixels, studio.picture(far, library, camera, size=SIZE), plan.counts


@pytest.mark.parametrize("kind", ["upright", "turned", "parts"])
def test_what_is_near_is_the_mesh_where_it_stood(studio: Studio, ball: Mesh, kind: str) -> None:
    mesh, baked = asset_of(kind, ball)
    scene = (0, (0.5, 0.1, 0), 0.7, 1.5), (0, (-1.5, 0, -1), 2.0, 0.7)
    camera = Camera((0.3, 1.2, 4.0), (0.4, 0.6, 0), 0.6)
    pixels, as_mesh, counts = pictures(studio, scene, ShapeLibrary([mesh], [baked]), camera, magnification=0.01)
    assert (counts["dpci"], counts["mesh"], counts["mesh_fallbacks"]) == (0, 2, 2)
    assert np.abs(pixels - as_mesh).mean() < 1e-4  # quaternions round
    images, _, counts = pictures(studio, scene, ShapeLibrary([mesh], [baked]), camera, magnification=0)
    assert (counts["dpci"] + counts["dmesh"], counts["mesh_fallbacks"]) == (2 * len(baked.parts), 0)
    assert (images != as_mesh).any()


def test_the_limit_is_a_texel_in_pixels(studio: Studio, ball: Mesh) -> None:
    """A ball ever nearer: a texel of the side image is as wide as 2πR/64, and high as 1/64."""
    library, texel, drawn = ShapeLibrary([ball], [bake(ball, resolution=64, layers=1)]), np.sqrt(np.pi) / 64, {}
    for distance in np.linspace(1.0, 8.0, 15):
        camera = Camera((0, 0.5, float(distance)), (0, 0.5, 0), 0.9)
        _, _, counts = pictures(studio, [(0, (0, 0, 0), 0.0, 1.0)], library, camera, magnification=1.0)
        pixels = View(camera, SIZE).focal_pixels / (distance - 0.5)
        drawn[pixels] = bool(counts["mesh_fallbacks"])
    for pixels, stands_in in drawn.items():
        if not 0.8 < pixels * texel < 1.25:
            assert stands_in == (pixels * texel > 1)
    assert set(drawn.values()) == {True, False}


def test_nothing_stands_in_for_what_is_no_mesh_or_has_more_on_it(studio: Studio, ball: Mesh) -> None:
    relief = np.zeros((4, 4, 3), np.float32)
    plain = bake(ball, resolution=64, layers=1)
    rough = BakedModel(parts=(replace(plain, meso=Meso(relief=relief, height=0.01, tile=(0.1, 0.1))),))
    camera = Camera((0, 0.5, 2), (0, 0.5, 0), 0.9)
    for library in (ShapeLibrary([ball], [rough]), ShapeLibrary([None], [plain])):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0))
        scene.render.lod.magnification = 0.01
        _, _, plan = studio.measured(scene, library, camera, size=SIZE)
        assert (plan.counts["dpci"], plan.counts["mesh_fallbacks"]) == (1, 0)


def test_one_stands_in_as_it_is_while_the_next_is_simplified(studio: Studio, dense: Mesh) -> None:
    """A stand-in of few triangles knows no coarser levels; who asks for `mesh-lod` draws them all the same."""
    camera = Camera((0, 0.5, 1.1), (0, 0.5, 0), 0.9)
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), (0, (4, 0, -40), 0.0, 1.0))
    scene.objects.representation[1] = Representation.MESH_LOD
    scene.render.lod.magnification = 0.01
    library = ShapeLibrary([dense], [bake(dense, resolution=64, layers=1)])
    _, _, plan = studio.measured(scene, library, camera, size=SIZE)
    assert (plan.counts["mesh"], plan.counts["mesh_fallbacks"]) == (2, 1)
    assert len(dense.faces) < plan.counts["mesh_triangles"] < 1.5 * len(dense.faces)


def test_distances_from_cylinders() -> None:
    viewer = np.array([[0, 0, 0], [3, 0, 0], [0, 5, 0], [0, -6, 4.0]])
    ones = np.ones(4)
    np.testing.assert_allclose(outside(viewer, np.zeros((4, 3)), 2 * ones, ones), [0, 2, 3, 5])


def test_a_walk_does_not_wait_for_meshes(gl_device: Device, ball: Mesh) -> None:
    library = SlowLibrary([ball], [bake(ball, resolution=32, layers=1)])
    before = Counter(gl_device.live)
    with Walk(gl_device, scene_of((0, (0, 0, 0), 0.0, 1.0)), library, seconds=0.01) as walk:
        walk.renderer.settings.lod.magnification = 2.0
        for _ in range(3):
            walk.look(NEAR)
            assert (walk.counts["dpci"], walk.counts["mesh_fallbacks"]) == (1, 0)
        library.may.set()
        draws_until(walk, lambda: walk.counts["mesh_fallbacks"] == 1)
        assert (walk.counts["dpci"], walk.counts["mesh"], library.read) == (0, 1, [0])
        walk.look(AWAY)
        assert (walk.counts["dpci"], walk.counts["mesh_fallbacks"]) == (1, 0)
        assert not library.forgotten
        walk.renderer.settings.gpu_memory = 1  # what is not needed goes
        for _ in range(3):
            walk.look(AWAY)
        assert library.forgotten == [0] and walk.renderer.assets.meshes.fallback_bytes == 0
        for _ in range(3):  # where there is no room, nothing is read
            walk.look(NEAR)
            assert (walk.counts["dpci"], walk.counts["mesh_fallbacks"], library.read) == (1, 0, [0])
        walk.renderer.settings.gpu_memory = DEFAULT_BUDGET
        draws_until(walk, lambda: walk.counts["mesh_fallbacks"] == 1)
    assert +gl_device.live == +before


def test_a_frame_agrees_whether_a_mesh_has_come(gl_device: Device, ball: Mesh) -> None:
    """Also where it comes between two views of the frame, as of two shadow maps."""
    library = SlowLibrary([ball], [bake(ball, resolution=32, layers=1)])
    with Walk(gl_device, scene_of((0, (0, 0, 0), 0.0, 1.0)), library, seconds=0.01) as walk:
        walk.look(NEAR)
        renderer, mesh = walk.renderer, np.array([0])
        frame = FrameResidency(renderer.world, renderer.assets, 0.01)
        assert not frame.is_mesh_resident(mesh).any()
        library.may.set()
        for _ in range(2000):
            if FrameResidency(renderer.world, renderer.assets, 0.01).is_mesh_resident(mesh).all():
                break
            threading.Event().wait(0.005)
        else:
            raise AssertionError("the mesh never came")
        assert not frame.is_mesh_resident(mesh).any()


def test_a_mesh_that_cannot_be_read_is_told_of_once(
    gl_device: Device, ball: Mesh, caplog: pytest.LogCaptureFixture
) -> None:
    library = SlowLibrary([ball], [bake(ball, resolution=32, layers=1)])
    library.broken = True
    library.may.set()
    with Walk(gl_device, scene_of((0, (0, 0, 0), 0.0, 1.0)), library, seconds=0.01) as walk:
        walk.renderer.settings.lod.magnification = 2.0
        draws_until(walk, lambda: caplog.records)
        for _ in range(3):
            walk.look(NEAR)
        assert [record.message for record in caplog.records] == ["ball.ply: has gone"]
        assert (walk.counts["dpci"], walk.counts["mesh_fallbacks"], library.read) == (1, 0, [0])


def test_large_meshes_stand_in_simplified(gl_device: Device, dense: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (depthwalk.render.lod.mesh_lod, depthwalk.render.lod.fallback_rule):
        monkeypatch.setattr(module, "MOST_UNSIMPLIFIED", 1000)
    monkeypatch.setattr(depthwalk.render.lod.mesh_lod, "MOST_LIGHT", 0)
    library = ShapeLibrary([dense], [bake(dense, resolution=16, layers=1)])
    with Walk(gl_device, scene_of((0, (0, 0, 0), 0.0, 1.0)), library, seconds=None) as walk:
        walk.renderer.settings.lod.magnification = 1.0
        walk.renderer.settings.mesh.error = 8.0
        walk.look(NEAR)
        assert walk.counts["mesh_fallbacks"] == 1 and 0 < walk.counts["mesh_triangles"] < len(dense.faces) / 2


def test_too_many_triangles_for_its_pixels_do_not_stand_in(
    gl_device: Device, dense: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither in the first frame, which knows of them only when they have come, nor later."""
    monkeypatch.setattr(depthwalk.render.draw.object_detail, "MESH_TEXELS", 0.0)  # nor do fewer
    library = ShapeLibrary([dense], [bake(dense, resolution=16, layers=1)])
    with Walk(gl_device, scene_of((0, (0, 0, 0), 0.0, 4.0)), library, seconds=None) as walk:
        walk.renderer.settings.lod.magnification = 1.0
        for _ in range(2):
            walk.look(Camera((0, 2, 10), (0, 2, 0), 0.9))
            assert (walk.counts["dpci"], walk.counts["mesh_fallbacks"]) == (1, 0)
    few = ShapeLibrary([sphere(0.5, columns=16, rows=8)], [bake(dense, resolution=16, layers=1)])
    with Walk(gl_device, scene_of((0, (0, 0, 0), 0.0, 4.0)), few, seconds=None) as walk:
        walk.renderer.settings.lod.magnification = 1.0
        walk.look(Camera((0, 2, 9), (0, 2, 0), 0.9))
        assert (walk.counts["dpci"], walk.counts["mesh_fallbacks"]) == (0, 1)


def test_a_coarser_mesh_stands_in_for_its_pixels(gl_device: Device, dense: Mesh) -> None:
    """Where all its triangles are too many: still more accurate than depth images of 16 texels."""
    library = ShapeLibrary([dense], [bake(dense, resolution=16, layers=1)])
    with Walk(gl_device, scene_of((0, (0, 0, 0), 0.0, 4.0)), library, seconds=None) as walk:
        walk.renderer.settings.lod.magnification = 1.0
        walk.renderer.settings.mesh.error = 0.0
        walk.look(Camera((0, 2, 10), (0, 2, 0), 0.9))
        assert (walk.counts["dpci"], walk.counts["mesh_fallbacks"]) == (0, 1)
        assert 0 < walk.counts["mesh_triangles"] < len(dense.faces) / 2


def test_frozen_levels_freeze_what_stands_in(gl_device: Device, ball: Mesh) -> None:
    library = ShapeLibrary([ball], [bake(ball, resolution=32, layers=1)])
    with Walk(gl_device, scene_of((0, (0, 0, 0), 0.0, 1.0)), library, seconds=None) as walk:
        lod = walk.renderer.settings.lod
        lod.magnification = 2.0
        for first, other, mesh_fallbacks in ((NEAR, AWAY, 1), (AWAY, NEAR, 0)):
            lod.freeze = False
            walk.look(first)
            lod.freeze = True
            walk.look(first)
            walk.look(other)
            assert walk.counts["mesh_fallbacks"] == mesh_fallbacks
        lod.freeze = False
        walk.look(NEAR)
        assert walk.counts["mesh_fallbacks"] == 1


@pytest.mark.slow
def test_a_viewer_within_a_room_sees_its_mesh(studio: Studio) -> None:
    """Its walls, which nobody outside sees, are in no depth image; the mesh has too many triangles for its pixels."""
    wall = sphere(1.0, columns=40, rows=20)
    wall = replace(wall, faces=wall.faces[:, ::-1], normals=-wall.normals)
    room = joined(box(2.2, 2.2, 2.2, (0, wall.positions[:, 1].mean(), 0)), wall)
    baked = bake_model(room, ModelParams(resolution=32, layers=1), "")
    unsaid = BakedModel(parts=tuple(replace(part, has_interior=False) for part in baked.parts))
    centre = float(wall.positions[:, 1].mean())
    inside, outside_ = (Camera((0.0, centre, z), (0.0, centre, z - 1), 1.0) for z in (0.3, 4.0))
    for camera, model, found in ((inside, baked, 1), (inside, unsaid, 0), (outside_, baked, 0)):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0))
        scene.render.lod.magnification = 1.0
        pixels, _, plan = studio.measured(scene, ShapeLibrary([room], [model]), camera, size=(48, 36))
        assert plan.counts["mesh_fallbacks"] == found
        if found:
            as_mesh = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH)
            truth = studio.picture(as_mesh, ShapeLibrary([room], [model]), camera, size=(48, 36))
            assert np.abs(pixels - truth).max() < 0.05

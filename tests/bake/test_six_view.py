"""Sampling by six views against sampling by rays, and where the choice is made."""

import logging
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from typer.testing import CliRunner

from depthwalk.assets.asset_files import mesh_key
from depthwalk.bake import six_view
from depthwalk.bake.baker import bake_object, cast_face, connect_face
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.file import read_baked, write_baked
from depthwalk.bake.grid import layer_triangles
from depthwalk.bake.images import PAPER_FACES, Cylinder, Face, enclosing_cylinder
from depthwalk.bake.params import BakeParams, ModelParams, Refinements
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.samples import FaceSamples
from depthwalk.bake.six_view import sample_six_views
from depthwalk.commands.cli import app
from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.headless_device import headless_device
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Mesh
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset
from files import write_ply
from shapes import box, joined, model_of, sphere

pytestmark = pytest.mark.usefixtures("gl_device")


def grid_of(cylinder: Cylinder, face: Face, size: int) -> FaceGrid:
    """The texels of one face's square images."""
    return FaceGrid(cylinder=cylinder, face=face, height=size, width=size)


def rays_and_views(
    mesh: Mesh, size: int, layers: int = 1
) -> tuple[dict[Face, FaceSamples], dict[Face, FaceSamples], Cylinder]:
    """The samples of each face by rays, `layers` deep, and by six views, and the cylinder."""
    cylinder = enclosing_cylinder(mesh.positions)
    caster = RayCaster(mesh)
    params = BakeParams(resolution=size, layers=layers)
    rays = {face: cast_face(mesh, caster, grid_of(cylinder, face, size), params) for face in PAPER_FACES}
    return rays, sample_six_views(mesh, cylinder, size), cylinder


SHAPES: dict[str, Callable[[], Mesh]] = {
    "ball": lambda: sphere(columns=512, rows=256),
    "box": lambda: box(1.0, 2.0, 1.5, (0, 1, 0)),
}


@cache
def sampled(shape: str) -> tuple[dict[Face, FaceSamples], dict[Face, FaceSamples], Cylinder]:
    return rays_and_views(SHAPES[shape](), 128)


def agreement(rays: dict[Face, FaceSamples], views: dict[Face, FaceSamples], cylinder: Cylinder, face: Face) -> float:
    """Part of the texels, of those that either finds filled, whose depths agree within a texel."""
    ray, view = rays[face].samples.depth[0], views[face].samples.depth[0]
    with np.errstate(invalid="ignore"):
        agree = np.abs(ray - view) <= grid_of(cylinder, face, len(ray)).longest_texel
    return agree.sum() / (np.isfinite(ray) | np.isfinite(view)).sum()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("face", PAPER_FACES)
def test_views_see_what_rays_meet(shape: str, face: Face) -> None:
    rays, views, cylinder = sampled(shape)
    assert agreement(rays, views, cylinder, face) > 0.999
    ray, view = rays[face], views[face]
    both = np.isfinite(ray.samples.depth[0]) & np.isfinite(view.samples.depth[0])
    assert np.median(np.abs(ray.samples.depth[0][both] - view.samples.depth[0][both])) < 2e-4 * cylinder.radius
    cosine = np.einsum("ijc,ijc->ij", ray.normal[0], view.normal[0])[both]
    assert np.quantile(cosine, 0.01) > 0.999
    assert np.abs(ray.albedo[0] - view.albedo[0])[both].max() < 1e-5
    np.testing.assert_array_equal(view.samples.flipped, False)


def test_colours_are_those_of_the_place() -> None:
    half = sphere(columns=256, rows=128)
    half.colours[half.positions[:, 0] > 0] = (0, 0, 255)
    _, views, _ = rays_and_views(half, 64)
    albedo = views[Face.SIDE].albedo[0]
    right = np.cos(2 * np.pi * (np.arange(64) + 0.5) / 64) > 0.1
    left = np.cos(2 * np.pi * (np.arange(64) + 0.5) / 64) < -0.1
    assert (albedo[8:-8, right, 2] > 0.99).all() and (albedo[8:-8, right, 0] < 0.01).all()
    assert (albedo[8:-8, left, 0] > 0.5).all() and (albedo[8:-8, left, 2] < 0.2).all()
    assert albedo[..., 3] == pytest.approx(0.15)


def test_rays_past_the_axis_meet_the_far_surface() -> None:
    post = box(0.4, 2.0, 0.6, (0.7, 1, 0))
    rays, views, cylinder = rays_and_views(post, 256)
    side = views[Face.SIDE]
    opposite = side.samples.depth[0][:, 127:129]  # θ = π: the post is behind the axis
    assert opposite == pytest.approx(cylinder.radius + 0.5, abs=0.01)
    assert side.normal[0][:, 127:129, 0] == pytest.approx(-1, abs=0.01)
    assert agreement(rays, views, cylinder, Face.SIDE) > 0.99


def test_nothing_hangs_between_surfaces() -> None:
    """A post before a plate: every sample lies on one of the surfaces along its ray."""
    scene = joined(box(0.3, 1.0, 0.1, (0, 0.5, 0.9)), box(1.8, 1.0, 0.1, (0, 0.5, -0.5)))
    rays, views, cylinder = rays_and_views(scene, 128, layers=4)
    for face in PAPER_FACES:
        view, ray = views[face].samples.depth[0], rays[face].samples.depth
        solid = np.isfinite(view)
        off = np.abs(view - np.where(np.isfinite(ray), ray, 1e9)).min(0)[solid]
        assert solid.sum() > 700
        assert (off < 2 * grid_of(cylinder, face, 128).longest_texel).mean() > 0.999


def test_only_the_nearest_surface_is_kept() -> None:
    """A ball between four walls."""
    walls = [box(1.9, 2.0, 0.1, (0, 1, z)) for z in (-0.95, 0.95)] + [
        box(0.1, 2.0, 1.9, (x, 1, 0)) for x in (-0.95, 0.95)
    ]
    ball = sphere(radius=0.3, columns=64, rows=32)
    ball = replace(ball, positions=ball.positions + np.array([0, 0.7, 0], np.float32))
    _, views, cylinder = rays_and_views(joined(*walls, ball), 64)
    side = views[Face.SIDE].samples.depth[0]
    assert np.isfinite(side).all()
    assert side.max() < cylinder.radius - 0.9  # of the walls: the ball is 0.3 from the axis


def test_sampling_is_deterministic() -> None:
    mesh = sphere(columns=64, rows=32)
    cylinder = enclosing_cylinder(mesh.positions)
    first, second = (sample_six_views(mesh, cylinder, 32)[Face.SIDE] for _ in range(2))
    np.testing.assert_array_equal(first.samples.depth, second.samples.depth)
    np.testing.assert_array_equal(first.normal, second.normal)
    np.testing.assert_array_equal(first.albedo, second.albedo)


def test_a_baked_object_is_complete(tmp_path: Path) -> None:
    stages: list[str] = []
    mesh = sphere(columns=128, rows=64)
    baked = bake_object(mesh, BakeParams(resolution=64, layers=1, method="six-view"), "key", stages.append)
    faces = [f"{face} image" for face in ("top", "side", "bottom")]
    assert stages == ["drawing six views", *faces, "best samples", "edges"]
    assert [image.name for image in baked.images] == ["top.0", "side.0", "bottom.0"]
    cast = bake_object(mesh, BakeParams(resolution=64, layers=1, refinements=Refinements(box_faces=False)), "key")
    for image, other in zip(baked.images, (each for each in cast.images if each.layer == 0), strict=True):
        count, wanted = (len(layer_triangles(each, 0)[0]) for each in (image, other))
        assert count == pytest.approx(wanted, rel=0.02) and wanted > 1000
    write_baked(tmp_path / "ball.dpci.exr", model_of(baked))
    np.testing.assert_array_equal(
        read_baked(tmp_path / "ball.dpci.exr").parts[0].images[1].depth, baked.images[1].depth
    )


def test_a_face_that_sees_nothing_has_no_image() -> None:
    mesh = sphere(columns=32, rows=16)
    cylinder = enclosing_cylinder(mesh.positions)
    seen = sample_six_views(mesh, cylinder, 16)[Face.SIDE]
    empty = replace(seen, samples=replace(seen.samples, depth=np.full_like(seen.samples.depth, np.inf)))
    assert connect_face(RayCaster(mesh), grid_of(cylinder, Face.SIDE, 16), empty, 1) == []


def test_the_callers_context_stays_current_and_all_is_released(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Device] = []
    monkeypatch.setattr(six_view, "headless_device", lambda: made.append(headless_device()) or made[0])
    scope = gl_device.scope("test")
    mesh = sphere(columns=32, rows=16)
    sample_six_views(mesh, enclosing_cylinder(mesh.positions), 16)
    texture = scope.texture((1, 1), 4, data=b"\1\2\3\4")
    assert texture.read() == b"\1\2\3\4"
    scope.release()
    assert len(made) == 1 and not +made[0].live


def test_missing_opengl_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> None:
        raise GpuError("no OpenGL 3.3 context: nothing here")

    monkeypatch.setattr(six_view, "headless_device", none)
    mesh = box(1.0, 1.0, 1.0)
    with pytest.raises(GpuError, match=r"six-view draws with OpenGL, .*raycast does not: no OpenGL 3\.3 context"):
        bake_object(mesh, BakeParams(resolution=16, layers=1, method="six-view"), "")
    assert bake_object(mesh, BakeParams(resolution=16, layers=1), "").images


def test_six_views_make_one_layer() -> None:
    with pytest.raises(InputError, match="layers 2: method six-view sees one surface per ray"):
        BakeParams(resolution=64, layers=2, method="six-view")


def test_the_papers_method_is_six_views_and_nothing_more() -> None:
    """Two boxes, one above the other: every cell whose corners are filled is drawn, across the gap too."""
    mesh = joined(box(0.6, 0.6, 0.6, (0, 0.3, 0)), box(0.3, 0.2, 0.2, (0, 0.9, 0.2)))
    stages: list[str] = []
    baked = bake_object(mesh, BakeParams(resolution=64, layers=1, method="paper"), "key", stages.append)
    faces = [f"{face} image" for face in ("top", "side", "bottom")]
    assert stages == ["drawing six views", *faces, "edges"]
    assert [image.name for image in baked.images] == ["top.0", "side.0", "bottom.0"]
    assert not baked.boundary_strips and all((image.owner == image.face).all() for image in baked.images)
    top = baked.images[0]
    filled = np.isfinite(top.depth)
    corners = filled[:-1, :-1] + 0 + filled[1:, :-1] + filled[:-1, 1:] + filled[1:, 1:]
    triangles = (top.cells[0] & 1) + (top.cells[0] >> 7 & 1)
    assert (triangles.reshape(63, 63)[corners == 4] == 2).all()
    cut = bake_object(mesh, BakeParams(resolution=64, layers=1, method="six-view"), "key")
    assert sum(len(layer_triangles(image, 0)[0]) for image in cut.images) < sum(
        len(layer_triangles(image, 0)[0]) for image in baked.images
    )
    with pytest.raises(InputError, match="layers 3: method paper sees one surface per ray"):
        BakeParams(resolution=64, layers=3, method="paper")


def test_the_key_names_the_method(tmp_path: Path) -> None:
    spec = MeshAsset(
        name="ball",
        mesh=write_ply(tmp_path / "ball.ply", sphere(columns=8, rows=4)),
        texture=None,
        up="y",
        height=None,
        dpci=None,
    )
    keys = [
        mesh_key(spec, ModelParams(resolution=64, layers=1, method=method))
        for method in ("raycast", "six-view", "paper")
    ]
    assert len(set(keys)) == 3
    assert keys[0] == mesh_key(spec, ModelParams(resolution=64, layers=1))


@pytest.mark.parametrize("method", ["six-view", "paper"])
def test_a_scene_names_the_method(tiny_scene: Path, method: str) -> None:
    text = tiny_scene.read_text()
    tiny_scene.write_text(text.replace("layers: 1", f"method: {method}"))
    (asset,) = load_scene(tiny_scene).assets
    assert isinstance(asset, MeshAsset) and asset.dpci is not None
    dpci = asset.dpci
    assert (dpci.method, dpci.layers) == (method, 1)
    tiny_scene.write_text(text.replace("layers: 1", f"method: {method}, layers: 2"))
    located = rf"scene\.yaml:3:\d+: assets\.ball\.dpci: method {method} .* layers must be 1"
    with pytest.raises(InputError, match=located):
        load_scene(tiny_scene)


def test_the_command_bakes_by_six_views(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = logging.getLogger("depthwalk")
    before = log.handlers, log.propagate, log.level
    used: list[tuple[object, ...]] = []
    sample = sample_six_views
    monkeypatch.setattr(six_view, "sample_six_views", lambda *given: used.append(given) or sample(*given))
    try:
        ball = str(write_ply(tmp_path / "ball.ply", sphere(columns=32, rows=16)))
        run = CliRunner().invoke
        refused = run(app, ["bake", ball, "--method", "six-view", "--layers", "3"])
        assert (refused.exit_code, refused.stdout, used) == (2, "", [])
        assert refused.stderr.startswith("--layers 3: method six-view sees one surface per ray")
        assert run(app, ["bake", ball, "--method", "six-view", "--dpci-resolution", "32"]).exit_code == 0
    finally:
        log.handlers, log.propagate, log.level = before
    assert len(used) == 1
    assert {image.layer for image in read_baked(tmp_path / "ball.dpci.exr").parts[0].images} == {0}


@pytest.mark.parametrize(
    ("model", "up", "least"), [("nefertiti", "z", 0.99), ("stanford-bunny", "y", 0.99), ("spot", "y", 0.94)]
)
def test_real_models_agree(real_scenes: Path, model: str, up: Literal["y", "z"], least: float) -> None:
    mesh = load_mesh(real_scenes / "models" / f"{model}.obj", up=up, height=2.0)
    rays, views, cylinder = rays_and_views(mesh, 256)
    assert agreement(rays, views, cylinder, Face.SIDE) > least
    assert agreement(rays, views, cylinder, Face.TOP) > 0.999
    assert agreement(rays, views, cylinder, Face.BOTTOM) > 0.999


def test_gaps_a_texel_wide_are_closed_but_no_steps() -> None:
    texels = np.zeros((4, 8, 12), np.float32)
    texels[:, :, 0], texels[:, :, 8], texels[:, :, -1] = 1, 1, 1
    texels[:, :, 3] = 0.5
    texels[:, 4:, 3] = 0.9
    texels[1, 2] = texels[2, 4] = texels[1, 0] = 0  # on a surface; beside a step; on the seam, which is a step
    six_view._close_gaps(texels, 0.1)
    assert texels[1, 2, 3] == 0.5 and texels[1, 2, [0, 8, -1]].tolist() == [1, 1, 1]
    assert texels[2, 4, 3] == pytest.approx(0.9)  # its column goes on
    assert texels[1, 0, 3] == 0.5
    texels[:, 4] = 0
    six_view._close_gaps(texels, 0.1)
    assert not texels[:, 4].any()

"""Meso-structure: the twin against differences of displaced surfaces, the shaders against the twin."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import binary_erosion

from depthwalk.bake.images import Face, face_outward
from depthwalk.bake.meso import Meso, tiling_slopes
from depthwalk.bake.meso_file import load_meso
from depthwalk.errors import InputError
from depthwalk.ingest.mesh import Mesh
from depthwalk.reference.meso import displaced, tilted, wind
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset
from depthwalk.types import Array
from shapes import ShapeLibrary, bake, box, joined, mesh_of, scene_of
from studio import Studio


def waves(height: float = 0.1, tile: tuple[float, float] = (0.5, 0.4), size: int = 256) -> Meso:
    """Long waves in both directions."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * 2 * np.pi
    depth = height * (0.5 + 0.25 * np.sin(x) + 0.25 * np.cos(2 * y))
    relief = np.concatenate([depth[..., None], tiling_slopes(depth, tile)], -1)
    return Meso(relief=relief.astype(np.float32), tile=tile, height=height)


def egg(u: Array, v: Array, face: Face, radius: float = 0.8) -> tuple[Array, Array]:
    """Points and unit normals (n, 3) of a smooth surface over a face."""

    def point(u: Array, v: Array) -> Array:
        if face is Face.SIDE:
            r = radius * (1 + 0.12 * np.sin(u) + 0.18 * v)
            return np.stack([r * np.cos(u), v, r * np.sin(u)], -1)
        outward = face_outward(face)
        across = np.roll(np.abs(outward), 1)
        out = (1.5 - 0.2 * u**2 - 0.1 * u * v)[:, None] * outward
        return out + u[:, None] * across + v[:, None] * np.cross(outward, across)

    return point(u, v), normals_of(point, u, v, face)


def normals_of(point: Callable[..., Any], u: Array, v: Array, face: Face, step: float = 1e-5) -> Array:
    along_u = point(u + step, v) - point(u - step, v)
    along_v = point(u, v + step) - point(u, v - step)
    normal = np.cross(along_u, along_v)
    at = point(u, v)
    outward = at * [1, 0, 1] if face is Face.SIDE else np.broadcast_to(face_outward(face), at.shape)
    normal *= np.sign(np.einsum("ni,ni->n", normal, outward))[:, None]
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


@pytest.mark.parametrize(("face", "radius"), [*((face, 0.8) for face in Face), (Face.SIDE, 0.2)])
def test_normals_are_those_of_the_displaced_surface(face: Face, radius: float) -> None:
    rng = np.random.default_rng(4)
    u, v = rng.uniform(-0.7, 0.7, (2, 400))
    meso = waves(height=0.03)
    points, normals = egg(u, v, face, radius)
    moved = displaced(points, normals, face, meso, 1.0)
    expected = normals_of(lambda u, v: displaced(*egg(u, v, face, radius), face, meso, 1.0), u, v, face, 2e-3)
    found = tilted(normals, moved, face, meso, 1.0)
    cosine = np.einsum("ni,ni->n", found, expected)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 1.5
    tilt = np.einsum("ni,ni->n", normals, expected)
    assert np.degrees(np.arccos(np.clip(tilt, -1, 1))).max() > 10


def test_tiles_meet_round_the_side() -> None:
    points = np.array([[-1, 0.3, 1e-7], [-1, 0.3, -1e-7]])
    uv = wind(points, waves(), 1.0).uv
    assert abs(uv[0, 0] - uv[1, 0]) == pytest.approx(13)  # 2π / 0.5, rounded
    one, other = displaced(points, points, Face.SIDE, waves(), 1.0)
    np.testing.assert_allclose(one, other, atol=1e-5)


def test_no_place_is_moved_past_another() -> None:
    """Towards the axis distances shrink, but never to nothing."""
    away = np.geomspace(1e-4, 1, 2000)
    for angle in np.linspace(0, 2, 7):
        points = away[:, None] * [np.cos(angle), 0, np.sin(angle)] + [0, angle, 0]
        moved = displaced(points, points, Face.SIDE, waves(height=0.25), 1.0)
        steps = np.diff(np.hypot(moved[:, 0], moved[:, 2])) / np.diff(away)
        assert steps.min() > 0.5 - 1e-6 and steps.max() < 1 + 1e-6


def pillar(
    radius: float = 0.5,
    columns: int = 256,
    rows: int = 128,
    height: float = 2.0,
    meso: Meso | None = None,
    cylinder: float = 0.5,
) -> Mesh:
    """A tube with level ends, displaced where a meso-structure is given."""
    theta, y = np.meshgrid(np.linspace(0, 2 * np.pi, columns + 1), np.linspace(0, height, rows + 1))
    outward = np.stack([np.cos(theta), 0 * y, np.sin(theta)], -1).reshape(-1, 3)
    points: Array = radius * outward + y.reshape(-1, 1) * [0, 1, 0]
    normals: Array = outward
    if meso is not None:
        points = displaced(points, outward, Face.SIDE, meso, cylinder)
        normals = tilted(outward, points, Face.SIDE, meso, cylinder)
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    a = (j * (columns + 1) + i).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    tube = mesh_of(points, np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)]), normals)
    k = np.arange(columns)
    ends = []
    for rim, turn, sign in ((points[: columns + 1], 1, -1), (points[-columns - 1 :], -1, 1)):
        middle = [[0, rim[0, 1], 0]]
        fan = np.stack([k, k + 1, np.full(columns, columns + 1)], -1)[:, ::turn]
        ends.append(mesh_of(np.concatenate([rim, middle]), fan, np.tile([0, sign, 0], (columns + 2, 1))))
    return joined(tube, *ends)


def beside(mesh: Mesh, metres: float) -> Mesh:
    return replace(mesh, positions=mesh.positions + np.array([metres, 0, 0], np.float32))


@pytest.fixture(scope="module")
def pillars() -> ShapeLibrary:
    """Depth images of a smooth pillar with meso-structure, and the mesh that they stand for."""
    baked = bake(pillar(), 128, 1)
    meso = waves()
    mesh = pillar(meso=meso, cylinder=baked.cylinder.radius)
    # Meshes stand on their base; so do depth images, by their own frame.
    return ShapeLibrary([mesh, pillar()], [replace(baked, meso=meso), baked])


def picture(
    studio: Studio, library: ShapeLibrary, asset: int, representation: Representation, camera: Camera, **settings: int
) -> tuple[Array, Array]:
    scene = scene_of((asset, (0, 0, 0), 0.0, 1.0), representation=representation)
    for name, value in settings.items():
        setattr(scene.render.lod, name, value)
    return studio.measured(scene, library, camera, size=(320, 240), transparent=True)[:2]


@pytest.mark.parametrize("representation", [Representation.DPCI, Representation.DMESH])
def test_pictures_are_those_of_a_displaced_mesh(
    studio: Studio, pillars: ShapeLibrary, representation: Representation
) -> None:
    camera = Camera((0.3, 1.2, 2.6), (0, 1, 0), 0.55)
    pixels, metres = picture(studio, pillars, 0, representation, camera)
    wanted, distance = picture(studio, pillars, 0, Representation.MESH, camera)
    _, plain = picture(studio, pillars, 1, Representation.DPCI, camera)
    rows = slice(20, -20)  # the ends ease to level
    seen, expected = pixels[rows, :, 3] > 0.5, wanted[rows, :, 3] > 0.5
    assert (seen & expected).sum() > 0.99 * (seen | expected).sum()
    both = seen & expected
    off = np.abs(metres[rows][both] - distance[rows][both])
    assert np.median(off) < 0.004 and np.percentile(off, 95) < 0.02
    assert np.median(np.abs(plain[rows][both] - distance[rows][both])) > 0.03
    assert np.abs(pixels - wanted)[rows][both].mean() < 0.02


def test_what_faces_round_the_axis_keeps_its_surface(studio: Studio) -> None:
    """A post that stands beside the axis, like an arm: most of what is seen of it from in front faces along θ."""
    mesh = joined(pillar(0.2), beside(pillar(0.1), 0.6))
    baked = bake(mesh, 96, 2)
    library = ShapeLibrary([mesh, mesh], [replace(baked, meso=waves(height=0.03)), baked])
    for position in ((0.3, 1.2, 2.6), (0.3, 1.2, -2.6), (1.5, 1.8, 2.0)):
        camera = Camera(position, (0.3, 1, 0), 0.55)
        relief, _ = picture(studio, library, 0, Representation.DPCI, camera)
        plain, _ = picture(studio, library, 1, Representation.DPCI, camera)
        inside = binary_erosion(plain[..., 3] > 0.5, iterations=8)  # as far as 3 cm reach
        assert inside.sum() > 4000
        assert (relief[inside, 3] < 0.5).sum() < 0.001 * inside.sum()


def test_what_lies_below_an_edge_has_its_own_colour(studio: Studio) -> None:
    """A blue step on a red base; the relief is level, and eases out towards where they meet."""
    base = box(1, 0.3, 1, (0, 0.15, 0), colour=(255, 20, 20))
    mesh = joined(base, box(0.5, 0.06, 0.5, (0, 0.33, 0), colour=(20, 20, 255)))
    level = np.zeros((8, 8, 3), np.float32) + np.array([0.06, 0, 0], np.float32)
    library = ShapeLibrary([mesh], [replace(bake(mesh, 64, 3), meso=Meso(relief=level, tile=(0.5, 0.5), height=0.06))])
    camera = Camera((0.7, 1.6, 0.9), (0, 0.2, 0), 0.7)
    colour, metres = picture(studio, library, 0, Representation.DPCI, camera)
    height, width = metres.shape
    down, across = np.mgrid[:height, :width] + 0.5
    view = View(camera, (width, height))
    rays = np.stack([2 * across / width - 1, 1 - 2 * down / height, np.ones_like(across)], -1) @ view.ray_from_screen.T
    y = 1.6 + rays[..., 1] * metres
    bluish = colour[..., 2] > colour[..., 0]
    assert (bluish & (y < 0.297)).sum() < 0.008 * bluish.sum()


def test_relief_deeper_than_a_slab_ends_at_its_base(studio: Studio) -> None:
    """Else its top sinks 20 cm into the floor, and out of the bounds by which objects are culled and tiles are cut."""
    mesh, camera = box(1, 0.1, 1, (0, 0.05, 0)), Camera((0, 1.5, 2), (0, 0, 0), 0.6)
    level = np.zeros((8, 8, 3), np.float32) + np.array([0.3, 0, 0], np.float32)
    library = ShapeLibrary([mesh], [replace(bake(mesh, 48, 1), meso=Meso(relief=level, tile=(0.5, 0.5), height=0.3))])
    _, metres = picture(studio, library, 0, Representation.DPCI, camera)
    height, width = metres.shape
    up = 1 - 2 * (np.arange(height) + 0.5) / height
    rays = np.stack([0 * up, up, 0 * up + 1], -1) @ View(camera, (width, height)).ray_from_screen.T
    y = (1.5 + rays[:, 1:2] * metres)[np.isfinite(metres)]
    assert len(y) > 4000 and np.percentile(y, 20) == pytest.approx(0, abs=0.005)
    assert y.min() > -0.01


def test_relief_too_small_to_see_is_shading_only(studio: Studio, pillars: ShapeLibrary) -> None:
    camera = Camera((0.3, 1.2, 2.6), (0, 1, 0), 0.55)
    plain, flat = picture(studio, pillars, 1, Representation.DPCI, camera)
    faded, depth = picture(studio, pillars, 0, Representation.DPCI, camera, meso_fade=1000)
    # Coarse cells are for smooth surfaces only: a fraction of a millimetre lies between the two grids.
    np.testing.assert_allclose(depth[40:-40, 120:200], flat[40:-40, 120:200], atol=2e-3)
    assert np.abs(faded - plain)[40:-40, 120:200, :3].mean() > 0.01


def test_a_tile_from_files(tmp_path: Path) -> None:
    y, x = np.mgrid[0:32, 0:64] / 64 * 2 * np.pi
    grey = np.round(65535 * (0.5 + 0.5 * np.sin(x) * np.cos(2 * y))).astype(np.uint16)
    Image.fromarray(grey).save(tmp_path / "relief.png")
    meso = load_meso(tmp_path / "relief.png", height=0.02, tile=(0.4, 0.2))
    np.testing.assert_allclose(meso.relief[..., 0], 0.02 * (1 - grey[::-1] / 65535.0), atol=1e-6)
    slope = -0.01 * np.cos(x) * np.cos(2 * y) * 2 * np.pi / 0.4
    np.testing.assert_allclose(meso.relief[..., 1], slope[::-1], atol=1e-3)
    normal = np.full((8, 8, 3), (165, 90, 250), np.uint8)
    Image.fromarray(normal).save(tmp_path / "normal.png")
    mapped = load_meso(tmp_path / "relief.png", height=0.02, tile=(0.4, 0.2), normal=tmp_path / "normal.png")
    np.testing.assert_allclose(mapped.relief[..., 1:], np.broadcast_to([0.306, -0.306], (32, 64, 2)), atol=0.01)
    Image.fromarray(np.dstack([grey >> 8, (grey > 20000) * 255]).astype(np.uint8), "LA").save(tmp_path / "holes.png")
    with pytest.raises(InputError, match=r"holes\.png: \d+ pixels of the tile hold no depth"):
        load_meso(tmp_path / "holes.png", height=0.02, tile=(0.4, 0.2))


def test_the_scene_file_names_a_tile(tmp_path: Path) -> None:
    """A tile that is there is resolved; one that is not is an error at its place."""
    (tmp_path / "box.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    Image.new("L", (4, 4), 99).save(tmp_path / "bark.png")
    text = "version: 1\nassets:\n  box: {mesh: box.obj, dpci: {meso: {depth: %s, height: 0.02, tile: [0.3, 0.4]}}}\n"
    scene = tmp_path / "scene.yaml"
    scene.write_text(text % "bark.png")
    (asset,) = load_scene(scene).assets
    assert isinstance(asset, MeshAsset) and asset.dpci is not None
    meso = asset.dpci.meso
    assert meso is not None
    assert (meso.depth, meso.normal, meso.tile) == (tmp_path / "bark.png", None, (0.3, 0.4))
    scene.write_text(text % "oak.png")
    located = r"scene\.yaml:3:\d+: assets\.box\.dpci\.meso\.depth: file 'oak\.png' not found"
    with pytest.raises(InputError, match=located):
        load_scene(scene)

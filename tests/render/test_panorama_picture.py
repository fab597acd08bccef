"""A panorama of a room that is made here: baked, and seen from its pinhole and beside it."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from depthwalk.bake.images import BakedObject, Face
from depthwalk.bake.panorama import bake_panorama
from depthwalk.bake.planar import range_mesh
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.surface import surface_at
from depthwalk.errors import InputError
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.range_image import PanoramaLens, RangeImage
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.types import Array
from shapes import ShapeLibrary, box, joined, scene_of, shared
from studio import Studio

WIDTH, HEIGHT = 192, 132
LENS = PanoramaLens(width=WIDTH, horizon=71.5)
EYE = np.array([0.0, 1.4, 0.0])
WALLS = np.array([2.0, 1.5])  # x and z, metres; the room is 2.6 m high
LIGHT: dict[str, Any] = {"sun": {"intensity": 0.0}, "ambient": {"intensity": 1.0}}
CAMERAS = {
    "ahead": Camera((0, 1.4, 0), (0.9, 1.0, -1.0), 1.0),
    "back": Camera((0, 1.4, 0), (-0.5, 1.2, 1.0), 1.0),
    "seam": Camera((0, 1.4, 0), (0.05, 1.5, 1.0), 0.7),
    "beside": Camera((0.6, 1.75, 0.1), (1.0, 0.9, -1.0), 1.0),
}


@cache
def room() -> Mesh:
    """A room seen from inside, with a block on its floor."""
    walls = box(2 * WALLS[0], 2.6, 2 * WALLS[1], (0, 1.3, 0), colour=(200, 80, 80))
    inward = replace(walls, faces=walls.faces[:, ::-1].copy(), normals=-walls.normals)
    return joined(inward, box(0.5, 0.8, 0.5, (1.1, 0.4, -0.7), colour=(80, 90, 200)))


@cache
def panorama() -> RangeImage:
    rays = LENS.rays((HEIGHT, WIDTH))
    length = np.linalg.norm(rays, axis=-1)
    direction = (rays / length[..., None]).reshape(-1, 3).astype(np.float32)
    origin = np.tile(EYE.astype(np.float32), (len(direction), 1))
    hits = RayCaster(room(), two_sided=True).peel(origin, direction, 1, 100.0)
    _, albedo = surface_at(room(), hits)
    shape = HEIGHT, WIDTH
    return RangeImage(
        depth=(hits.distance[0].reshape(shape) / length).astype(np.float32),
        colour=np.round(255 * albedo[0, :, :3] ** (1 / 2.2)).astype(np.uint8).reshape(*shape, 3),
        normal=hits.normal[0].reshape(*shape, 3),
        lens=LENS,
    )


@cache
def baked(cut: bool) -> BakedObject:
    return shared(bake_panorama, panorama(), "test", cut)


@cache
def library(cut: bool) -> ShapeLibrary:
    return ShapeLibrary([room()], [baked(cut)])


def picture(studio: Studio, camera: Camera, cut: bool, representation: Representation = Representation.DPCI) -> Array:
    """RGBA (H, W, 4), transparent where nothing is."""
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=representation, **LIGHT)
    return studio.picture(scene, library(cut), camera, size=(160, 120), transparent=True)


def test_the_mesh_closes_at_the_seam() -> None:
    mesh = range_mesh(panorama(), cut=False)
    assert len(mesh.faces) == 2 * WIDTH * (HEIGHT - 1)
    assert len(range_mesh(panorama()).faces) < len(mesh.faces)
    corners = mesh.positions[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ni,ni->n", normal, corners[:, 0]) <= 1e-6).all()  # all of it faces the pinhole


def test_the_side_holds_the_inner_walls_beyond_the_axis() -> None:
    object_ = baked(True)
    side = next(image for image in object_.images if (image.face, image.layer) == (Face.SIDE, 0))
    reach = side.depth - object_.cylinder.radius
    rows, columns = side.depth.shape
    level = int((0.4 - object_.cylinder.bottom) / object_.cylinder.height * rows)  # above the block
    turn = 2 * np.pi * (np.arange(columns) + 0.5) / columns
    expected = np.min(WALLS[:, None] / np.abs([np.cos(turn), np.sin(turn)]), axis=0)
    assert (reach[np.isfinite(reach)] > 0).all()
    assert reach[level] == pytest.approx(expected, abs=0.02)
    assert object_.position == pytest.approx((0, 1.4, 0), abs=1e-3) and {image.face for image in object_.images} == {
        *Face
    }


def test_rays_pass_through_the_backs_of_walls() -> None:
    down, above = np.array([[0, -1.0, 0]], np.float32), np.array([[0.3, 5.0, 0.2]], np.float32)
    backs = replace(room(), faces=room().faces[:, ::-1].copy())  # winding alone says which side is the front
    either = RayCaster(room(), two_sided=False).peel(above, down, 2, 10.0)
    front = RayCaster(room(), two_sided=False, front_only=True).peel(above, down, 2, 10.0)
    assert either.distance[:, 0] == pytest.approx([2.4, 5.0]) and either.flipped[:, 0].tolist() == [True, False]
    assert front.distance[0, 0] == pytest.approx(5.0) and np.isinf(front.distance[1, 0])
    turned = RayCaster(backs, two_sided=False, front_only=True).peel(above, down, 2, 10.0)
    assert turned.distance[0, 0] == pytest.approx(2.4)


@pytest.mark.parametrize("cut", [True, False])
@pytest.mark.parametrize("place", ["ahead", "back", "seam"])
def test_from_the_pinhole_it_is_the_room(studio: Studio, place: str, cut: bool) -> None:
    camera = CAMERAS[place]
    found, known = (picture(studio, camera, cut, way) for way in (Representation.DPCI, Representation.MESH))
    assert (found[..., 3] > 0).mean() > (0.97 if cut else 0.995)  # torn, the outline of the block is open
    both = found[..., 3] > 0
    difference = np.abs(found - known)[both, :3].max(-1)
    assert np.median(difference) < 0.02 and (difference > 0.1).mean() < 0.03


def test_beside_it_what_was_hidden_is_open_or_spanned(studio: Studio) -> None:
    torn, spanned = (picture(studio, CAMERAS["beside"], cut)[..., 3] == 0 for cut in (True, False))
    assert torn.mean() > spanned.mean() + 0.01


def test_a_plain_is_seen_from_above(studio: Studio) -> None:
    """Its side is empty, since level rays graze it."""
    rise = LENS.rays((HEIGHT, WIDTH))[..., 1]
    depth = np.where(rise < -0.2, -1.4 / np.minimum(rise, -0.2), np.inf).astype(np.float32)
    object_ = bake_panorama(replace(panorama(), depth=depth), "plain")
    side = [image for image in object_.images if image.face is Face.SIDE]
    assert len(side) == 1 and not np.isfinite(side[0].depth).any()
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), **LIGHT)
    camera = Camera((0, 1.4, 0), (1.0, 0.6, -1.0), 0.5)
    shown = studio.picture(scene, ShapeLibrary([room()], [object_], kept=False), camera, transparent=True)
    assert (shown[..., 3] > 0).mean() > 0.95


def test_a_picture_without_surface_is_refused() -> None:
    depth = np.full((HEIGHT, WIDTH), np.inf, np.float32)
    depth[::2, ::2] = 1.0
    with pytest.raises(InputError, match="holds no surface"):
        bake_panorama(replace(panorama(), depth=depth), "test")

"""What plans are told of objects and assets, by a store that has no GPU."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
import pytest

from depthwalk.bake.images import BakedObject
from depthwalk.bake.model import BakedModel
from depthwalk.geometry.quaternions import rotate
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.cooked_parts import CookedParts
from depthwalk.render.world.asset_table import asset_table
from depthwalk.render.world.object_rows import ObjectRows, rows_of
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from shapes import ShapeLibrary, bake, box, scene_of, sphere, two_halves

BALL, HALVES, BARE = range(3)


@dataclass
class Store:
    """Stands for an `AssetStore` whose frames wait, without a GPU."""

    parts: CookedParts
    background: None = None


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    """A ball of radius 0.5, the same in two parts, and a box without depth images."""
    ball = sphere(0.5, 32, 16)
    baked: list[BakedObject | BakedModel] = [bake(ball, 24, 1), two_halves(ball, 24), bake(ball, 24, 1)]
    made = ShapeLibrary([ball, ball, box(2.0, 1.0, 0.5, (0, 0.5, 0))], baked)
    made._baked[BARE] = None
    return made


@pytest.fixture
def parts(library: ShapeLibrary) -> CookedParts:
    return CookedParts(library)


@pytest.fixture
def store(parts: CookedParts) -> AssetStore:
    return cast(AssetStore, Store(parts))


def scene(*placed: tuple[int, Sequence[float], float, float]) -> Scene:
    return scene_of(*((asset, position, yaw, scale) for asset, position, yaw, scale in placed))


def middles(objects: Objects, parts: CookedParts) -> Array:
    """Where the cylinders of depth objects (n, 3) have their middles, world, metres."""
    cylinders = [parts.cooked(number).outline.cylinder for number in objects.asset.tolist()]
    middle = np.array([[0, (each.bottom + each.top) / 2, 0] for each in cylinders])
    return objects.position + objects.scale[:, None] * rotate(objects.rotation, middle)


def test_objects_are_a_row_for_each_part_or_their_mesh(library: ShapeLibrary, store: AssetStore) -> None:
    shown = scene((BALL, (0, 0, 0), 0.0, 1.0), (HALVES, (5, 0, 0), 0.0, 2.0), (BARE, (9, 0, 0), 0.0, 1.0))
    shown.objects.representation[2] = Representation.MESH
    objects = ObjectRows(scene=shown, library=library, store=store).place()
    assert objects.asset.tolist() == [3, 4, 5, BARE]
    assert objects.representation.tolist() == [Representation.DPCI] * 3 + [Representation.MESH]
    left, right = middles(objects.take(slice(1, 3)), store.parts)
    assert left[0] < 4.7 and right[0] > 5.3 and left[0] + right[0] == pytest.approx(10, abs=0.1)
    assert objects.position[3].tolist() == [9, 0, 0] and objects.scale.tolist() == [1, 2, 2, 1]


def test_parts_stand_where_their_turned_object_has_them(library: ShapeLibrary, store: AssetStore) -> None:
    halves = [scene((HALVES, (0, 0, 0), yaw, 1.0)) for yaw in (0.0, np.pi)]
    rows = [ObjectRows(scene=turned, library=library, store=store).place() for turned in halves]
    straight, turned = (middles(objects, store.parts) for objects in rows)
    np.testing.assert_allclose(turned, straight * (-1, 1, -1), atol=1e-6)
    assert np.abs(straight[:, 0]).min() > 0.15


def test_a_representation_is_used_where_an_asset_has_it(library: ShapeLibrary, store: AssetStore) -> None:
    shown = scene((BALL, (0, 0, 0), 0.0, 1.0), (HALVES, (5, 0, 0), 0.0, 1.0))
    assert ObjectRows(scene=shown, library=library, store=store, forced=Representation.MESH).place().asset.tolist() == [
        BALL,
        HALVES,
    ]
    assert len(store.parts) == len(library)  # whose depth images nobody asked for
    shown = scene((BARE, (0, 0, 0), 0.0, 1.0), (BALL, (5, 0, 0), 0.0, 1.0))
    shown.objects.representation[:] = Representation.MESH
    assert ObjectRows(
        scene=shown, library=library, store=store, forced=Representation.DMESH
    ).place().asset.tolist() == [BARE, 3]


def test_rows_of_some_objects_are_found_among_all(library: ShapeLibrary, store: AssetStore) -> None:
    shown = scene(*((asset, (k, 0, 0), 0.0, 1.0) for k, asset in enumerate((BALL, HALVES, BALL, HALVES))))
    everything = ObjectRows(scene=shown, library=library, store=store).place()
    owners = ObjectRows(scene=shown, library=library, store=store).owners()
    for which in (np.array([0]), np.array([1, 2]), np.array([0, 3]), np.arange(4)):
        rows = rows_of(which, owners)
        np.testing.assert_array_equal(
            everything.position[rows], ObjectRows(scene=shown, library=library, store=store).place(which).position
        )


def test_the_table_encloses_what_objects_use(library: ShapeLibrary, store: AssetStore) -> None:
    shown = scene((BALL, (0, 0, 0), 0.0, 1.0), (BARE, (5, 0, 0), 0.0, 1.0))
    shown.objects.representation[1] = Representation.MESH
    table = asset_table(ObjectRows(scene=shown, library=library, store=store).place(), library, store.parts)
    assert len(table.texel) == len(store.parts) == 4
    assert table.centre[BARE] == pytest.approx([0, 0.5, 0]) and table.half_height[BARE] == pytest.approx(0.5)
    assert table.cylinder_radius[BARE] == pytest.approx(np.hypot(1, 0.25))
    assert table.bounding_radius[BARE] == pytest.approx(np.linalg.norm([1, 0.5, 0.25]))
    assert (table.cylinder_radius[3], table.half_height[3]) == pytest.approx((0.5, 0.5), rel=0.1)
    assert table.area[3] == pytest.approx(1.0, rel=0.15)
    assert table.texel[3] == pytest.approx(np.sqrt(np.pi) / 24, rel=0.15)  # as large as one of the side's
    assert table.bounding_radius[HALVES] == 0 and table.mesh_fallbacks.mesh.tolist() == [-1, -1, -1, BALL]


def test_levels_that_an_asset_lacks_are_infinitely_wrong(library: ShapeLibrary, store: AssetStore) -> None:
    shown = scene((BALL, (0, 0, 0), 0.0, 1.0))
    table = asset_table(ObjectRows(scene=shown, library=library, store=store).place(), library, store.parts)
    cooked = store.parts.cooked(3)
    assert table.levels.tolist() == [0, 0, 0, len(cooked.error) - 1]
    np.testing.assert_array_equal(table.error[3], cooked.error)
    np.testing.assert_array_equal(table.index_count[3], cooked.count)
    assert np.isinf(table.error[:3]).all() and (table.triangles[:3] == 0).all() and (table.triangles[3] > 0).all()


def test_the_nearest_point_is_that_of_the_cylinder(library: ShapeLibrary, store: AssetStore) -> None:
    shown = scene((BARE, (0, 0, 0), 0.0, 1.0))
    shown.objects.representation[:] = Representation.MESH
    table = asset_table(ObjectRows(scene=shown, library=library, store=store).place(), library, store.parts)
    viewer = np.array([[0, 0.5, 0], [10, 0.5, 0], [0, 4, 0]])
    assert table.nearest(np.full(3, BARE), viewer) == pytest.approx([0, 10 - np.hypot(1, 0.25), 3])

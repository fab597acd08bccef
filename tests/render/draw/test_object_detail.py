"""The detail of objects: levels and pieces by the renderer's rules and the paper's, and what freezing keeps."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from depthwalk.cook.cases import ALL_PIECES, BOTTOM_PIECE, PAPER_PIECES, PAPER_SIDE, PIECES, TOP_PIECE, Case
from depthwalk.gpu.device import Device
from depthwalk.render.draw.object_detail import DetailSelector, choose_levels, choose_pieces, lasting_pieces
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.object_settings import LodParams, MeshLodParams, TileParams
from depthwalk.types import Array, Rows
from shapes import ShapeLibrary, scene_of, sphere
from stage import view_of


@pytest.fixture(scope="module")
def arrays(gl_device: Device) -> Iterator[SceneArrays]:
    """A row of balls, ever farther."""
    with gl_device.context:
        library = ShapeLibrary([sphere(0.5, 64, 32)], resolution=64)
        renderer = Renderer(gl_device, scene_of(*[(0, (0, 0, -4.0 * k), 0.0, 1.0) for k in range(8)]), library)
        yield renderer.world.arrays()
        renderer.release()


def viewers(view: View, objects: Objects) -> Array:
    return viewer_in_object(view, objects.position, objects.rotation, objects.scale)


def settings(**lod: float) -> PlanSettings:
    return PlanSettings(
        lod=LodParams.model_validate({**lod}), layout=TileParams(), polygons=MeshLodParams(), atlas_size=(256, 256)
    )


def level_and_pieces(selector: DetailSelector, view: View, arrays: SceneArrays, **lod: bool) -> tuple[Rows, Rows]:
    """Of all objects, once the selector knows of the settings."""
    plan_settings, objects = settings(**lod), arrays.objects
    selector.freeze_as_asked(view, arrays, plan_settings)
    rows = np.arange(len(objects))
    detail = selector.describe(view, arrays, rows, plan_settings.lod)
    np.testing.assert_array_equal(detail.triangles, arrays.table.triangles[objects.asset, detail.level])
    return detail.level, detail.pieces


def paper_table(arrays: SceneArrays) -> AssetTable:
    """As of balls that were cooked for the paper's cases: nothing is in the pieces that only the renderer knows."""
    count = arrays.table.index_count.copy()
    count[:, :, PAPER_SIDE + 1 : BOTTOM_PIECE] = 0
    return replace(arrays.table, index_count=count)


def levels(arrays: SceneArrays, view: View, **lod: object) -> Rows:
    table, seen_from = arrays.table, viewers(view, arrays.objects)
    return choose_levels(view, arrays.objects, arrays.bounds, seen_from, table, LodParams.model_validate(lod))


def test_levels_grow_with_distance_and_with_what_is_allowed(arrays: SceneArrays) -> None:
    fine, coarse = (levels(arrays, view_of(), error=error) for error in (0.1, 4.0))
    assert (np.diff(fine) >= 0).all() and (coarse >= fine).all() and (coarse > fine).any()


def test_the_papers_steps_are_no_coarser_than_allowed(arrays: SceneArrays) -> None:
    free, most, first = (levels(arrays, view_of(), mode="paper", max_step=step) for step in (64, 2, 1))
    assert free.max() > 1 and most.tolist() == np.minimum(free, 1).tolist() and not first.any()


def test_no_more_triangles_are_drawn_than_pixels_deserve(arrays: SceneArrays) -> None:
    """However small the error is to be."""
    many, few = (levels(arrays, view_of(), error=0.0, triangles_per_pixel=number) for number in (1e6, 20.0))
    assert not many.any() and (np.diff(few) >= 0).all() and few.max() > 1


def test_the_papers_cases_follow_the_height_alone(arrays: SceneArrays) -> None:
    lod, asset = LodParams.model_validate({"cases": "paper"}), arrays.objects.asset[:3]
    viewer = np.array([[3.0, 0.5, 0], [3.0, 9.0, 0], [3.0, -9.0, 0]])
    table = paper_table(arrays)
    pieces = choose_pieces(asset, np.zeros(3, int), viewer, table, lod)
    assert pieces.tolist() == PAPER_PIECES[[Case.SIDE, Case.SIDE_AND_TOP, Case.SIDE_AND_BOTTOM]].tolist()
    assert lasting_pieces(asset, np.zeros(3, int), viewer, table, lod).tolist() == pieces.tolist()
    assert (lasting_pieces(asset, np.zeros(3, int), viewer, arrays.table, LodParams()) == ALL_PIECES).all()


def test_side_and_cap_are_the_parts_of_a_case(arrays: SceneArrays) -> None:
    asset, none = arrays.objects.asset[:3], np.zeros(3, int)
    viewer = np.array([[3.0, 0.5, 0], [3.0, 9.0, 0], [3.0, -9.0, 0]])  # beside, above, below
    side, cap, both = (
        choose_pieces(asset, none, viewer, paper_table(arrays), LodParams(cases=cases))
        for cases in ("side", "cap", "paper")
    )
    assert (side == PAPER_PIECES[Case.SIDE]).all()
    assert cap.tolist() == [0, 1 << TOP_PIECE, 1 << BOTTOM_PIECE]
    assert ((cap & both) == cap).all() and (side & cap == 0).all()
    of_images = sum(1 << piece for piece in range(PIECES))  # the rest is drawn where an image is missing
    assert (((side | cap) & of_images) == (both & of_images)).all()


@pytest.mark.parametrize("cases", ["paper", "side", "cap"])
def test_objects_that_were_not_cooked_for_cases_stay_whole(arrays: SceneArrays, cases: str) -> None:
    """As those of scenes that name cooked depth images."""
    viewer = np.array([[3.0, 0.5, 0], [3.0, 9.0, 0], [3.0, -9.0, 0]])
    lod = LodParams.model_validate({"cases": cases})
    pieces = choose_pieces(arrays.objects.asset[:3], np.zeros(3, int), viewer, arrays.table, lod)
    assert (pieces == ALL_PIECES).all()


def test_what_is_drawn_directly_keeps_all_pieces(arrays: SceneArrays) -> None:
    selector, view = DetailSelector(), view_of((0.0, 8.0, 5.0))
    _, pieces = level_and_pieces(selector, view, arrays)
    assert (pieces != ALL_PIECES).any()
    representation = arrays.objects.representation.copy()
    arrays.objects.representation[2:] = Representation.DMESH
    _, direct = level_and_pieces(selector, view, arrays)
    arrays.objects.representation[:] = representation
    assert (direct[:2] == pieces[:2]).all() and (direct[2:] == ALL_PIECES).all()


def test_frozen_detail_stays_until_it_is_thawed(arrays: SceneArrays) -> None:
    selector, near, far = DetailSelector(), view_of(), view_of((0.0, 1.6, 60.0), far=200.0)
    level, pieces = level_and_pieces(selector, near, arrays, freeze=True)
    for frozen, before in zip(level_and_pieces(selector, far, arrays, freeze=True), (level, pieces), strict=True):
        np.testing.assert_array_equal(frozen, before)
    thawed, _ = level_and_pieces(selector, far, arrays)
    assert (thawed > level).any()


def test_frozen_detail_is_that_of_the_present_assets(arrays: SceneArrays) -> None:
    """Other assets have other levels: those of the ones before would be wrong or out of range."""
    selector, near, far = DetailSelector(), view_of(), view_of((0.0, 1.6, 60.0), far=200.0)
    level, _ = level_and_pieces(selector, near, arrays, freeze=True)
    others = replace(arrays, table=replace(arrays.table))
    found, _ = level_and_pieces(selector, far, others, freeze=True)
    assert (found > level).any()


def test_frozen_meshes_are_drawn_where_they_are_resident(arrays: SceneArrays) -> None:
    selector, view = DetailSelector(), view_of((0.0, 0.5, 1.2))
    plan_settings, rows = settings(freeze=True, magnification=0.01), np.arange(len(arrays.objects))
    selector.freeze_as_asked(view, arrays, plan_settings)

    def drawn(resident: bool) -> Rows:
        return selector.replaced(view, arrays, rows, plan_settings, lambda meshes: np.full(len(meshes), resident))

    every, none = drawn(True), drawn(False)
    assert len(every) and not len(none)

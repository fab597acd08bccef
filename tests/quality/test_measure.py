"""Depth images measured against their mesh, and what is said about poor candidates."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import shapes
from depthwalk.bake.images import Face
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.bake.sampling import sample_surface
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Mesh
from depthwalk.quality.advise import recommend
from depthwalk.quality.candidate import Candidate, count_parts, examine, warnings
from depthwalk.quality.goals import MEASURES, summarise
from depthwalk.quality.measure import ViewQuality, measure, measure_views, object_height
from depthwalk.quality.pair_renderer import Pair, PairRenderer, RgbdPicture
from depthwalk.quality.report import (
    CompareReport,
    Costs,
    ModelReport,
    costs_line,
    missed_notes,
    overall,
    to_json,
    to_text,
)
from depthwalk.quality.views import SPHERE, Viewpoint
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.types import Mask

SIZE = 96, 72
LEVEL = Viewpoint(5.0, 30.0)
PSNR = MEASURES[0]


@pytest.fixture(scope="module")
def ball() -> tuple[Mesh, BakedModel]:
    mesh = shapes.sphere(0.5, columns=64, rows=32)
    return mesh, shapes.model_of(shapes.bake(mesh, 64, 1))


def caps_only(model: BakedModel) -> BakedModel:
    """Depth images of which only the caps show anything."""
    (baked,) = model.parts
    caps = Face.TOP, Face.BOTTOM
    bare = [
        image if image.face in caps else replace(image, cells=tuple(np.zeros_like(level) for level in image.cells))
        for image in baked.images
    ]
    kept = tuple(border for border in baked.boundary_strips if border.face in caps)
    return shapes.model_of(replace(baked, images=tuple(bare), boundary_strips=kept))


def quality(psnr: float, viewpoint: Viewpoint = LEVEL, **values: float) -> ViewQuality:
    return ViewQuality(
        viewpoint=viewpoint,
        pixels=100,
        psnr=psnr,
        **{"iou": 1, "flip": 0, "holes": 0, "depth_median": 0, "depth_p99": 0} | values,
    )


def shot(covered: Mask, colour: int, distance: float = 3.0) -> RgbdPicture:
    pixels = np.full((*covered.shape, 3), 128, np.uint8)
    pixels[covered] = colour
    return RgbdPicture(pixels, np.where(covered, np.float32(distance), np.float32(np.inf)))


def measured(pair: Pair, height: float) -> tuple[ViewQuality, ...]:
    return measure_views(cast(PairRenderer, SimpleNamespace(pair=lambda viewpoint: pair)), height, [LEVEL])


def test_a_pair_with_a_hole_is_measured() -> None:
    mesh = np.zeros((60, 60), bool)
    mesh[10:50, 10:50] = True
    holed = mesh.copy()
    holed[20:30, 20:30] = False
    (found,) = measured(Pair(shot(mesh, 200), shot(holed, 200, 3.1)), 2.0)
    assert found.pixels == 1600 and found.viewpoint is LEVEL
    assert found.iou == pytest.approx(15 / 16) and found.holes == pytest.approx(100 / 16)
    assert found.psnr == pytest.approx(10 * math.log10(255**2 / (72**2 / 16)))
    assert found.depth_median == pytest.approx(0.05, abs=1e-6)
    assert 0 < found.flip < 1


def test_a_view_that_shows_nothing_is_left_out() -> None:
    nothing = shot(np.zeros((20, 20), bool), 0)
    assert measured(Pair(nothing, nothing), 1.0) == ()


def test_a_ball_is_much_like_its_mesh(gl_device: Device, ball: tuple[Mesh, BakedModel]) -> None:
    found = measure(*ball, RenderSettings(), SIZE, SPHERE[::10])
    assert [view.viewpoint for view in found.views] == list(SPHERE[::10])
    assert all(view.iou > 0.97 and view.holes == 0 and view.psnr > 25 for view in found.views)
    assert all(view.depth_median < 0.002 for view in found.views)
    grids = build_grid_lods(ball[1].parts[0])
    texels = len(np.unique(grids.texels[grids.texels[:, 0] >= 0], axis=0))  # at least; each has a normal
    assert found.gpu_bytes > grids.vertices.nbytes + grids.indices.nbytes + 4 * texels


def test_a_missing_side_is_a_hole(gl_device: Device, ball: tuple[Mesh, BakedModel]) -> None:
    mesh, baked = ball
    (whole,) = measure(mesh, baked, RenderSettings(), SIZE, [LEVEL]).views
    (bare,) = measure(mesh, caps_only(baked), RenderSettings(), SIZE, [LEVEL]).views
    assert bare.pixels == whole.pixels
    assert bare.holes > 30 and bare.iou < 0.7 and bare.psnr < whole.psnr - 5


def test_the_renderer_draws_the_mesh_and_the_images(gl_device: Device, ball: tuple[Mesh, BakedModel]) -> None:
    with PairRenderer(*ball, RenderSettings(), SIZE) as renderer:
        pair = renderer.pair(LEVEL)
        again = renderer.pair(LEVEL)
    assert pair.mesh.pixels[0, 0] == pytest.approx(127.5, abs=1)
    assert np.array_equal(pair.mesh.pixels[0, 0], pair.dpci.pixels[0, 0])
    assert np.array_equal(pair.mesh.pixels, again.mesh.pixels)
    assert not np.array_equal(pair.mesh.distance, pair.dpci.distance)
    # A ball of radius 0.5 whose outline is 0.9 of 72 pixels high.
    assert pair.mesh.covered.sum() == pytest.approx(math.pi * 32.4**2, rel=0.02)


def test_flat_objects_are_measured_by_their_extent() -> None:
    assert object_height(shapes.box(2, 0.5, 3)) == pytest.approx(0.5)
    assert object_height(shapes.box(2, 0.001, 3)) == pytest.approx(3)


def test_samples_lie_on_the_surface_evenly() -> None:
    points, normals = sample_surface(shapes.box(2, 1, 1), 3000)
    assert np.abs(points * normals).max(1) == pytest.approx(np.where(np.abs(normals[:, 0]) > 0.5, 1, 0.5))
    assert (np.abs(normals[:, 0]) > 0.5).mean() == pytest.approx(2 / 10, abs=0.01)


@pytest.mark.slow
def test_a_ball_is_a_good_candidate(ball: tuple[Mesh, BakedModel]) -> None:
    candidate = examine(*ball, ModelParams(resolution=64, layers=2))
    assert candidate.coverage > 0.99 and candidate.thin == 0 and candidate.parts == 1
    assert warnings(candidate, outlines=True) == []


@pytest.mark.slow
def test_poor_candidates_are_named_with_the_reason(ball: tuple[Mesh, BakedModel]) -> None:
    mesh, baked = ball
    bare = examine(mesh, caps_only(baked), ModelParams(resolution=64, layers=2))
    away, told = "is farther than a texel from all triangles of the depth images", "more layers, or a finer resolution"
    missing = 100 * (1 - bare.coverage)
    assert missing > 20 and warnings(bare, outlines=True)[0] == f"{missing:.1f} % of its visible surface {away}: {told}"
    card = shapes.box(1, 1, 0.002)
    assert examine(card, shapes.model_of(shapes.bake(card, 64, 2)), ModelParams(resolution=64, layers=2)).thin > 0.9
    assert warnings(Candidate(coverage=1.0, thin=0.05, parts=99, texel=0.01), outlines=False) == [
        "5.0 % of its surface is thinner than a texel (10 mm): a finer resolution",
        "it has 99 separate parts, which hide each other: more layers, or several objects",
    ]


def test_foliage_is_better_drawn_as_its_mesh() -> None:
    assert warnings(Candidate(coverage=1.0, thin=0.5, parts=1, texel=0.01), outlines=False) == [
        "foliage: 50.0 % of its surface is thinner than a texel (10 mm), and most of its pixels are edges; "
        "draw it as its mesh"
    ]


def test_a_thin_sheet_with_right_outlines_is_no_foliage() -> None:
    """Water in a basin."""
    assert warnings(Candidate(coverage=1.0, thin=0.25, parts=1, texel=0.01), outlines=True) == [
        "25.0 % of its surface is thinner than a texel (10 mm): a finer resolution"
    ]


@pytest.mark.slow
def test_more_layers_are_recommended_where_they_hold_more() -> None:
    plates = shapes.joined(*(shapes.box(2.0, 0.2, 2.0, (0, 0.5 * number, 0)) for number in range(4)))
    params = ModelParams(resolution=32, layers=2)
    candidate = examine(plates, bake_model(plates, params, ""), params)
    assert candidate.deeper is not None and (candidate.deeper.now.layers, candidate.deeper.then.layers) == (2, 4)
    lines = warnings(candidate, outlines=True)
    line = next(line for line in lines if line.startswith("layers: 4, or auto: 0.0 % of its visible"))
    assert f"not {100 * candidate.deeper.now.missing:.1f}, and a texel covers" in line
    for enough in ModelParams(resolution=32, layers=4), ModelParams(resolution=32, layers="auto"):
        assert examine(plates, bake_model(plates, enough, ""), enough).deeper is None


def test_parts_are_counted_through_split_vertices() -> None:
    box = shapes.box(1, 1, 1)  # its faces share positions, not vertices
    crumb = shapes.box(0.01, 0.01, 0.01, centre=(3, 0, 0))
    assert count_parts(box) == 1
    assert count_parts(shapes.joined(box, shapes.box(1, 1, 1, centre=(3, 0, 0)))) == 2
    assert count_parts(shapes.joined(box, crumb)) == 1


def test_the_cheapest_bake_that_suffices_is_recommended(gl_device: Device) -> None:
    mesh = shapes.sphere(0.5, columns=32, rows=16)
    some = SPHERE[::20]
    best = recommend(mesh, ModelParams(), RenderSettings(), SIZE, 99.0, some, (16, 32))
    assert not best.reached and best.best.psnr == max(trial.psnr for trial in best.trials)
    assert best.text().startswith("99 dB is out of reach; best is --dpci-resolution")
    # A ball has one layer: the second brings nothing, the third is not tried.
    assert [(t.resolution, t.layers) for t in best.trials] == [(16, 1), (16, 2), (32, 1), (32, 2)]
    modest = recommend(mesh, ModelParams(), RenderSettings(), SIZE, best.trials[0].psnr - 0.5, some, (16, 32))
    assert modest.reached and modest.trials == best.trials[:1]
    assert modest.text().startswith(f"for {modest.wanted:g} dB: --dpci-resolution 16 --layers 1 (")


def test_the_worst_view_of_every_measure() -> None:
    views = [quality(30.0), quality(20.0, Viewpoint(60.0, 1.0)), quality(math.inf)]
    psnr = summarise(PSNR, views)
    assert (psnr.mean, psnr.worst, psnr.worst_view) == (math.inf, 20, Viewpoint(60.0, 1.0))
    depth = next(measure for measure in MEASURES if measure.key == "depth_p99")
    lacking = [quality(1.0, depth_p99=math.nan), quality(1.0, depth_p99=0.25), quality(1.0, depth_p99=0.75)]
    assert (summarise(depth, lacking).mean, summarise(depth, lacking).worst) == (0.5, 0.75)
    assert math.isnan(summarise(depth, lacking[:1]).mean)


def test_the_report_marks_goals_and_holds_no_infinity() -> None:
    candidate = Candidate(coverage=0.5, thin=0.0, parts=1, texel=0.01)

    def model(name: str, *views: ViewQuality) -> ModelReport:
        costs = Costs(bake_seconds=3.0, bake_peak_bytes=None, bytes_disk=1_000_000, bytes_gpu=20_000_000)
        return ModelReport(
            name=name,
            mesh=name,
            triangles=12,
            params=ModelParams(),
            objects=1,
            deepest=3,
            costs=costs,
            views=views,
            close=(),
            candidate=candidate,
            warnings=("holes",),
            recommendation=None,
        )

    models = model("a.ply", quality(34.0), quality(26.0)), model("b.ply", quality(math.inf))
    report = CompareReport(version="1", commit=None, renderer="driver", image_size=(64, 48), models=models)
    assert overall(PSNR, models[:1])[0].mean == 30
    summary, mesh = overall(PSNR, models)
    assert (summary.worst, mesh) == (26, "a.ply")
    text = to_text(report)
    assert "30.00 FAIL" in text and "26.00 FAIL" in text and "20.0 MB on the GPU FAIL (goal 16 MB)" in text
    assert next(line for line in text.splitlines() if "PSNR" in line).endswith("≥ 33, ≥ 27")
    assert text.splitlines()[-1].split()[-5:] == ["3.0", "–", "1.0", "20.0", "FAIL"]
    assert "baked in 3.0 s, " in text and "a poor candidate: holes" in text and "overall, 2 models" in text
    document = json.loads(to_json(report))
    assert document["models"][1]["summary"]["psnr"]["mean"] is None
    assert document["models"][1]["summary"]["psnr"]["mean_reached"] is True
    assert document["models"][0]["cost_goals"] == {"bake_seconds": True, "bytes_gpu": False}
    slow = replace(models[0], costs=replace(models[0].costs, bake_seconds=60.0))
    told = to_text(replace(report, models=(slow,)))
    assert told.count("FAIL") == to_text(replace(report, models=models[:1])).count("FAIL")
    assert "baked in 60.0 s, " in told and "goal 8 s" not in told  # the machine's fault, not that of the images
    assert json.loads(to_json(replace(report, models=(slow,))))["models"][0]["cost_goals"]["bake_seconds"] is False
    assert document["models"][0]["close_summary"]["psnr"] == {"mean": None, "worst": None, "worst_view": None}
    coarse = replace(
        models[0],
        params=ModelParams(resolution=256, axis="x"),
        objects=3,
        costs=Costs(bake_seconds=3.0, bake_peak_bytes=250_000_000, bytes_disk=0, bytes_gpu=0),
    )
    other = json.loads(to_json(replace(report, models=(coarse,))))
    assert other["models"][0]["dpci"] == {
        "resolution": 256,
        "layers": 3,
        "method": "raycast",
        "parts": 1,
        "axis": "x",
        "coordinates": "auto",
    }
    assert other["models"][0]["parts"] == 3
    assert missed_notes(models[0]) == [] and "FAIL: the" not in text  # as large as the goals are meant for
    assert "  FAIL: the goals are meant for 512² and 3 layers, where" in to_text(replace(report, models=(coarse,)))
    assert missed_notes(replace(coarse, views=(quality(34.0),))) == []
    assert "256², 3 layers, raycast in 3 parts" in costs_line(coarse) and "baked in 3.0 s within 250 MB" in costs_line(
        coarse
    )
    assert other["models"][0]["cost_goals"] == {"bake_seconds": None, "bytes_gpu": None}

"""What depth images leave out of a surface that views can see."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.bake.coverage import measure_left_out
from depthwalk.bake.file import read_baked, write_baked
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.ingest.mesh import Mesh
from shapes import box, joined, sphere


def stack(count: int) -> Mesh:
    """Plates one above the other, as far apart as they are thick."""
    return joined(*(box(2.0, 0.2, 2.0, (0, 0.5 * number, 0)) for number in range(count)))


def test_plates_that_no_layer_holds_are_left_out() -> None:
    """Of four, a layer holds the upper side of the first, the lower side of the last, and all their edges."""
    mesh = stack(4)
    model = bake_model(mesh, ModelParams(resolution=64, layers=4), "")
    assert measure_left_out(mesh, model) == 0
    left = []
    for layers in 3, 2, 1:
        parts = [replace(part, images=tuple(i for i in part.images if i.layer < layers)) for part in model.parts]
        left.append(measure_left_out(mesh, BakedModel(parts=tuple(parts))))
    assert 0.01 < left[0] < left[1] < left[2] < 0.5


def test_what_lies_past_the_axis_is_held() -> None:
    """The inner side of half a ball, of which caps see all but the edge."""
    whole = sphere(1.0, columns=64, rows=48)
    kept = whole.positions[whole.faces][..., 0].mean(1) < 0.3
    mesh = replace(whole, faces=whole.faces[kept], parts=(replace(whole.parts[0], face_count=int(kept.sum())),))
    model = bake_model(mesh, ModelParams(resolution=96, layers=2), "")
    side = replace(model.parts[0], images=tuple(i for i in model.parts[0].images if i.face.name == "SIDE"))
    assert measure_left_out(mesh, model) < 0.002
    assert measure_left_out(mesh, BakedModel(parts=(side,))) < 0.2


def test_parts_hold_a_mesh_together() -> None:
    mesh = stack(12)
    model = bake_model(mesh, ModelParams(resolution=48, layers=7, parts=2), "")
    assert [part.mesh_triangles for part in model.parts] == [len(mesh.faces)] * 2
    assert measure_left_out(mesh, model) == 0
    for part in model.parts:
        assert measure_left_out(mesh, BakedModel(parts=(part,))) == pytest.approx(0.5, abs=0.15)


def test_files_say_what_is_left_out(tmp_path: Path) -> None:
    file = tmp_path / "box.dpci.exr"
    model = bake_model(box(1.0, 1.0, 1.0), ModelParams(resolution=32, layers=1), "key")
    write_baked(file, model)
    assert read_baked(file).left_out is None
    write_baked(file, replace(model, left_out=0.125))
    assert read_baked(file).left_out == 0.125
    write_baked(file, replace(model, left_out=np.float64(1e-4)))
    assert read_baked(file).left_out == pytest.approx(1e-4)

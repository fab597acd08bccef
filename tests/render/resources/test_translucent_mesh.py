"""What of a mesh is translucent or glows."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from depthwalk.ingest.mesh import Material
from depthwalk.render.resources import translucent_mesh
from depthwalk.render.resources.translucent_mesh import gather_translucent
from shapes import box, panes

GLASS, STONE, LAMP = Material(opacity=0.5), Material(), Material(emission=(1.0, 2.0, 3.0))


def test_an_opaque_mesh_has_nothing_of_the_kind() -> None:
    assert gather_translucent(box(1, 1, 1)) is None
    assert not box(1, 1, 1).is_translucent


def test_translucent_triangles_come_first_and_glowing_ones_after_them() -> None:
    found = gather_translucent(panes((0.0, STONE), (1.0, GLASS), (2.0, LAMP)))
    assert found is not None
    assert found.faces.shape == (4, 3) and found.centroids.shape == (2, 3)
    (through,), (glowing,) = found.runs, found.glowing
    assert [(each.first, each.count) for each in (through, glowing)] == [(0, 2), (2, 2)]
    assert found.vertices[found.faces[:2]]["position"][..., 2].tolist() == [[1] * 3] * 2
    assert found.vertices["colour"][found.faces[0, 0]] == pytest.approx([0.8, 0.8, 0.8, 0.5])
    assert found.vertices[found.faces[2:]]["emission"].reshape(-1, 3).tolist() == [[1, 2, 3]] * 6
    assert found.centre.tolist() == [0, 1, 1.5] and found.radius == pytest.approx(np.sqrt(2.25))


def test_what_shares_a_texture_is_one_run() -> None:
    first, second = (np.full((1, 1, 4), value, np.uint8) for value in (10, 20))
    textures = first, second, first
    found = gather_translucent(panes(*((z, replace(GLASS, texture=each)) for z, each in enumerate(textures))))
    assert found is not None
    assert sorted(run.count for run in found.runs) == [2, 4]
    assert {id(run.colour): run.count for run in found.runs} == {id(first): 4, id(second): 2}


@pytest.mark.parametrize("cells", [1024, 5])  # of one texel, and of two
@pytest.mark.parametrize(("column", "lit"), [(1, True), (6, False)])
def test_triangles_that_show_only_black_do_not_glow(
    column: int, lit: bool, cells: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(translucent_mesh, "_MOST_CELLS", cells)
    texture = np.zeros((8, 8, 4), np.uint8)
    texture[4, column, 0] = 1
    mesh = panes((0.0, replace(LAMP, emission_texture=texture)))
    mesh.uv[:] = np.clip(mesh.uv, (0.2, 0.2), (0.4, 0.8))
    found = gather_translucent(mesh)
    assert (found is not None) == lit
    mesh.uv[:, 0] += 0.75  # across the edge of the texture, where it begins anew
    assert gather_translucent(mesh) is not None


def test_a_large_texture_that_glows_takes_little_more_memory() -> None:
    """However many materials show it."""
    texture = np.zeros((2048, 2048, 4), np.uint8)
    texture[-1, -1] = 255
    mesh = panes(*((float(z), replace(LAMP, emission_texture=texture)) for z in range(3)))
    tracemalloc.start()
    found = gather_translucent(mesh)
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found is not None and len(found.faces) == 6
    assert taken < 1.5 * texture.nbytes


def test_more_than_can_be_drawn_does_not_glow(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("depthwalk.render.resources.translucent_mesh.MAX_TRANSLUCENT_TRIANGLES", 1)
    assert gather_translucent(panes((0.0, LAMP))) is None
    assert caplog.messages == ["a mesh has 2 glowing triangles, the limit is 1; it is drawn without its glow"]

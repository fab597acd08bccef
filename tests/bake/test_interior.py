"""Whether a mesh has an inside to stand in."""

from dataclasses import replace

import pytest

from depthwalk.bake.interior import has_interior
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.bake.raycast import RayCaster
from depthwalk.ingest.mesh import Mesh
from shapes import box, joined, leaves, sphere


def inward(mesh: Mesh) -> Mesh:
    """The same surface, seen from within."""
    return replace(mesh, faces=mesh.faces[:, ::-1], normals=-mesh.normals)


ROOM = inward(box(4.0, 3.0, 5.0, (0, 1.5, 0)))
HOUSE = joined(box(4.4, 3.4, 5.4, (0, 1.5, 0)), ROOM, box(1.0, 0.8, 0.6, (0, 0.4, 0)))


@pytest.mark.parametrize(
    ("mesh", "enclosing"),
    [
        (ROOM, True),
        (HOUSE, True),
        (joined(HOUSE, box(12.0, 0.2, 12.0, (0, -0.2, 0))), True),
        (replace(ROOM, faces=ROOM.faces[6:]), False),  # a corner of a room, into which images see
        (box(4.0, 3.0, 5.0), False),
        (sphere(1.0, columns=24, rows=12), False),
        (joined(*[box(1.0, 1.0, 1.0, (1.5 * x, 0, 0)) for x in range(3)]), False),
        (leaves(200, 0.3), False),
    ],
)
def test_rooms_are_told_from_solids(mesh: Mesh, enclosing: bool) -> None:
    assert has_interior(mesh, RayCaster(mesh)) is enclosing


def test_depth_images_say_so() -> None:
    def baked(mesh: Mesh) -> BakedModel:
        return bake_model(mesh, ModelParams(resolution=16, layers=1), "")

    assert [part.has_interior for mesh in (HOUSE, box(1.0, 1.0, 1.0)) for part in baked(mesh).parts] == [True, False]

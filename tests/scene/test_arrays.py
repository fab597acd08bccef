"""Objects as arrays, and the camera."""

import numpy as np
import pytest
from pyglm import glm

from depthwalk.scene.arrays import OF_MESH, Camera, Objects, Representation


def objects_of(*kinds: Representation) -> Objects:
    count = len(kinds)
    return Objects(
        asset=np.arange(count, dtype=np.int32),
        position=np.zeros((count, 3), np.float32),
        rotation=np.tile(np.array([0, 0, 0, 1], np.float32), (count, 1)),
        scale=np.ones(count, np.float32),
        representation=np.array(kinds, np.uint8),
    )


def test_labels_are_those_of_scene_files() -> None:
    assert [kind.label for kind in Representation] == [
        "mesh",
        "dpci",
        "dmesh",
        "mesh-lod",
        "mesh-clusters",
        "relief",
        "distance",
        "parallax",
        "bump",
        "displacement",
        "relief-texture",
        "bar-texture",
        "octahedral",
        "billboard",
        "auto",
    ]


def test_which_are_polygons() -> None:
    objects = objects_of(*Representation)
    assert objects.of_mesh.tolist() == [kind in OF_MESH for kind in Representation]


def test_rows_are_taken_and_put() -> None:
    objects = objects_of(*Representation)
    assert objects.take(np.array([3, 1])).asset.tolist() == [3, 1]
    objects.put(np.array([0]), objects_of(Representation.DMESH))
    assert objects.representation[0] == Representation.DMESH and len(objects) == len(Representation)


def test_fields_are_given_by_name() -> None:
    columns = [getattr(objects_of(), name) for name in Objects.__dataclass_fields__]
    with pytest.raises(TypeError):
        Objects(*columns)  # type: ignore[call-arg]


def test_a_camera_moves_with_its_target() -> None:
    camera = Camera((0, 1, 2), (0, 1, 0), 1.0).moved(glm.dvec3(1, 0, 0))
    assert camera == Camera((1, 1, 2), (1, 1, 0), 1.0)
    assert camera.look == glm.dvec3(0, 0, -2)

"""Pictures of the same scene from FBX, COLLADA, 3D Studio and 3MF files, against those from an OBJ file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.ingest.loader import load_mesh
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.types import Array
from interchange_scenes import WRITERS, picture, scene, written
from shapes import ShapeLibrary, scene_of
from studio import Studio

pytestmark = pytest.mark.gl


def seen(studio: Studio, path: Path, azimuth: float) -> Array:
    mesh = load_mesh(path)
    dull = tuple(replace(each, specular=0.0) for each in mesh.materials)  # 3MF files know no highlights
    library = ShapeLibrary([replace(mesh, materials=dull)], [None])
    camera = Camera((9 * np.sin(azimuth), 4.0, 9 * np.cos(azimuth)), (0.0, 1.5, 0.0), 0.8)
    return studio.picture(scene_of((0, (0.0, 0.0, 0.0), 0.0, 1.0), representation=Representation.MESH), library, camera)


@pytest.mark.parametrize("kind", WRITERS)
def test_pictures_are_those_of_an_obj_file(studio: Studio, tmp_path: Path, kind: str) -> None:
    paths = [written(tmp_path, each, scene(), {"skin.png": picture()}) for each in ("obj", kind)]
    for azimuth in (0.4, 3.4):
        expected, found = (seen(studio, path, azimuth) for path in paths)
        assert np.ptp(expected[..., :3]) > 0.5
        error = float(np.square(found - expected).mean())
        assert error < 1e-5, f"PSNR {-10 * np.log10(error):.1f} dB"  # 50 dB

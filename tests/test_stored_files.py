"""Files that earlier versions wrote are read as they were meant.

`tests/stored` holds small files by the version that wrote them. Those of the last two minor versions stay; whoever
changes a format adds a file of the new one, and does not make the old ones again.
"""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.bake.file import read_baked
from depthwalk.cook.cooked_file import cooked_key, read_cooked
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path

STORED = Path(__file__).parent / "stored"
VERSIONS = ("0.1",)


@pytest.mark.parametrize("version", VERSIONS)
def test_baked_and_cooked_files_hold_the_same_object(version: str) -> None:
    (baked,) = read_baked(STORED / f"tip-{version}.dpci.exr").parts
    (cooked,) = read_cooked(STORED / f"tip-{version}.dpci.npz")
    assert cooked.outline.key == baked.key
    assert cooked_key(STORED / f"tip-{version}.dpci.npz") in (
        None,
        baked.key,
    )  # None: cooked by older code
    assert cooked.outline.cylinder == baked.cylinder
    assert baked.images[0].depth.shape == (16, 16)
    depths = np.concatenate([image.depth.ravel() for image in baked.images])
    assert np.isfinite(depths).sum() > 100
    geometry, _ = cooked.load()
    assert np.ptp(geometry.positions, axis=0) == pytest.approx([1, 1, 1], abs=0.1)


@pytest.mark.parametrize("name", ["tip-0.1", "tip-hull"])  # extents around the axis, and a hull in their place
def test_what_encloses_a_cooked_object_is_known(name: str) -> None:
    """Nothing reaches beyond it; a prism is close around the axis, a hull in all directions."""
    (cooked,) = read_cooked(STORED / f"{name}.dpci.npz")
    positions = cooked.load()[0].positions
    for flat in (1.0, 0.0):
        ways = np.random.default_rng(1).normal(size=(50, 3)) * [1, flat, 1]
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        reach, needed = (cooked.hull @ ways.T).max(0), (positions @ ways.T).max(0)
        assert (reach >= needed - 1e-6).all()
        if name == "tip-hull" or not flat:
            assert (reach <= needed + 0.02).all()


@pytest.mark.parametrize("version", VERSIONS)
def test_scenes_paths_and_places_mean_the_same(version: str) -> None:
    scene = load_scene(STORED / f"scene-{version}.yaml")
    assert len(scene.assets) == 3 and scene.render.aa == "fxaa" and scene.render.shadows.enabled
    np.testing.assert_allclose(scene.objects.position[:, 0], [-1.5, 0, 1.5, 0, 1])
    np.testing.assert_allclose(scene.objects.scale, [1, 1, 1, 1, 0.5])
    path = load_path(STORED / f"path-{version}.yaml")
    assert (path.fps, path.interpolation, path.times.tolist()) == (5, "step", [0, 1])
    assert path.sample(1.0).position == (0.5, 1, 3)

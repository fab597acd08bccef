"""Captured views are kept in the cache, and damaged files are passed over."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.array_file import write_arrays
from depthwalk.bake.capture import capture_views
from depthwalk.bake.capture_file import CAPTURES
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.ingest.mesh import Reflection
from shapes import box

PARAMS = CaptureParams(directions="sphere", count=3, resolution=8)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.cache.cache_folder", lambda: tmp_path / "baked")


@pytest.fixture(scope="module")
def views() -> CapturedViews:
    return replace(capture_views(box(1, 2, 1), PARAMS), reflection=Reflection(0.5, 1.0))


@pytest.mark.parametrize("reflection", [None, Reflection(0.25, 0.5)])
def test_views_are_found_again(cache: None, views: CapturedViews, reflection: Reflection | None) -> None:
    views = replace(views, reflection=reflection)
    CAPTURES.keep_value(views, "ab")
    found = CAPTURES.find_value(PARAMS, "ab")
    assert found is not None
    for field in fields(CapturedViews):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(views, field.name))
    assert CAPTURES.find_value(PARAMS, "cd") is None


@pytest.mark.parametrize(
    "changed",
    [
        {"colour": np.zeros((8, 8, 8, 4), np.uint8)},
        {"surface": np.zeros((9, 8, 8, 4), np.float32)},
        {"radius": np.array(np.nan)},
        {"radius": np.array(0.0)},
        {"centre": np.zeros(2)},
        {"reflection": np.array([0.5, 2.0])},
        {"reflection": np.array([0.5])},
    ],
)
def test_damaged_files_are_passed_over(cache: None, views: CapturedViews, changed: dict[str, object]) -> None:
    arrays = {field.name: np.asarray(getattr(views, field.name)) for field in fields(CapturedViews)}
    path = CAPTURES.file("ab")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(path, arrays | changed)
    assert CAPTURES.find_value(PARAMS, "ab") is None and not path.exists()

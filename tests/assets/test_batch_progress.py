"""How far the preparation of assets has come, by the stages that processes tell."""

from pathlib import Path

import pytest

from depthwalk.assets.progress import Batch
from depthwalk.scene.scene import BakedAsset

ASSETS = [BakedAsset(name=name, baked=Path(name), source=None) for name in ("oak", "elm")]


def test_stages_count_as_parts_of_an_assets_time() -> None:
    batch = Batch(total=2)
    begun = batch.progress(ASSETS)
    assert (begun.done, begun.total, begun.name, begun.stage) == (0, 2, "", "")
    assert begun.fraction == 0 and begun.seconds_left is None  # too early to say
    batch.note(0, "reading")
    batch.note(1, "preparing for the GPU")
    half_way = batch.progress(ASSETS)
    assert (half_way.name, half_way.stage) == ("elm", "preparing for the GPU")
    assert half_way.fraction == pytest.approx((0.02 + 0.5) / 2)
    assert half_way.seconds_left is not None and half_way.seconds_left >= 0
    batch.note(1, "reading")  # again, as after a file was replaced: what has passed has passed
    assert batch.progress(ASSETS).fraction == half_way.fraction


def test_within_a_stage_the_time_left_becomes_less(monkeypatch: pytest.MonkeyPatch) -> None:
    times = [100.0]
    monkeypatch.setattr("depthwalk.assets.progress.time.perf_counter", lambda: times[-1])
    batch = Batch(total=1, _began=100.0)
    batch.note(0, "reading")
    left = []
    stages = ("ray structure", "best samples", "preparing for the GPU", "", "")
    for moment, stage in zip((101.0, 104.0, 110.0, 112.0, 115.0), stages, strict=True):
        times.append(moment)
        if stage:
            batch.note(0, stage)
        left.append((batch.progress(ASSETS).fraction, batch.progress(ASSETS).seconds_left))
    assert left[2:] == [(0.5, 10.0), (0.6, pytest.approx(8.0)), (0.75, pytest.approx(5.0))]
    times.append(500.0)
    assert batch.progress(ASSETS).fraction == 0.98


def test_what_is_finished_is_no_longer_named() -> None:
    batch = Batch(total=2)
    batch.note(0, "side image")
    batch.note(1, "best samples")
    batch.finish(1)
    left = batch.progress(ASSETS)
    assert (left.done, left.name, left.stage) == (1, "oak", "side image")
    batch.finish(0)
    over = batch.progress(ASSETS)
    assert (over.done, over.fraction, over.name, over.seconds_left) == (2, 1, "", 0)

"""What a long walk in a window calls growth."""

import sys

import numpy as np
import pytest
from tools.window_soak import allocated_bytes, growth


def test_what_grows_after_the_warm_up_is_told_from_what_comes_and_goes() -> None:
    number = np.arange(40)
    frames, noise = 600 * number, np.random.default_rng(5).integers(-1_000_000, 1_000_000, 40)
    settled = 8e8 + 5e6 * np.minimum(number, 8)
    comes_and_goes = 180 + 9 * (number % 4 == 1)
    columns = (
        frames,
        settled + 1500 * frames + noise,
        2 * settled,
        8 + number // 20,
        comes_and_goes,
        comes_and_goes + number,
    )
    memory, (*_, descriptors, live, objects) = growth(np.stack(columns, 1).astype(np.int64))
    assert abs(memory - 1500) < 100 and (descriptors, live, objects) == (1, 0, 20)


@pytest.mark.skipif(sys.platform != "linux", reason="glibc")
def test_what_is_allocated_is_counted() -> None:
    before = allocated_bytes()
    kept = np.ones(40_000_000, np.uint8)
    held = allocated_bytes()
    assert held > before + 30e6  # what earlier tests left may be freed meanwhile
    del kept
    assert allocated_bytes() < held - 39e6

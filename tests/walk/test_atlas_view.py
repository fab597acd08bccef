"""The picture of the impostor atlas."""

from types import SimpleNamespace

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.walk.atlas_view import AtlasView


@pytest.mark.parametrize(("tiles", "shade", "aspect"), [([(0, 0, 4, 8)], (255, 255, 255), 0.5), ([], (15, 18, 26), 2)])
def test_near_is_bright_and_an_atlas_without_impostors_is_dark(
    gl_device: Device, tiles: list[tuple[int, ...]], shade: tuple[int, ...], aspect: float
) -> None:
    view = AtlasView(gl_device)
    scope = gl_device.scope("test")
    depth = scope.texture((8, 8), 1, "f4", np.zeros((8, 8), "<f4").tobytes())
    records = {"tile": np.array(tiles, float).reshape(-1, 4)}
    plan = SimpleNamespace(composite=SimpleNamespace(records=records))
    view.draw(SimpleNamespace(atlas_depth=depth, atlas_size=(8, 8)), plan)  # type: ignore[arg-type]
    assert np.frombuffer(view.texture.read(), np.uint8)[:3] == pytest.approx(shade, abs=1)
    assert view.aspect == aspect
    scope.release()
    view.release()

"""Pictures kept in tests/images. `pytest --update-goldens` replaces them and writes sheets of what changed to out/."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

FOLDER = Path(__file__).parent / "images"
SHEETS = Path(__file__).parent.parent / "out" / "goldens"
MEAN, MAX_WRONG = 0.004, 0.02  # of full scale: mean difference, and the part of pixels that differ by more than 0.1
PART = 0.25  # mean difference, of that which a pass makes


def compare(name: str, pixels: np.ndarray, update: bool, renderer: str, without: np.ndarray | None = None) -> None:
    """Compares `pixels` (H, W, 4) in [0, 1] with the golden picture `name`.

    renderer: the driver's name; only Mesa's llvmpipe, which made the golden pictures, rounds as they do.
    without: the same picture without the pass that it is about, which must differ from it by four times as much.
    """
    if "llvmpipe" not in renderer:
        pytest.skip("goldens are made by llvmpipe")
    path = FOLDER / f"{name}.png"
    found = np.round(pixels[..., :3] * 255).astype(np.uint8)
    golden = np.asarray(Image.open(path).convert("RGB")) if path.exists() else np.zeros_like(found)
    difference = np.abs(found.astype(float) - golden) / 255
    if difference.max() > 0:
        SHEETS.mkdir(parents=True, exist_ok=True)
        shown = np.round(np.clip(difference * 4, 0, 1) * 255).astype(np.uint8)
        Image.fromarray(np.concatenate([golden, found, shown], 1)).save(SHEETS / f"{name}.png")
    if update:
        Image.fromarray(found).save(path, optimize=True)
        return
    assert path.exists(), f"no golden picture {name}: run pytest --update-goldens"
    wrong = (difference.max(-1) > 0.1).mean()
    mean = MEAN if without is None else min(MEAN, PART * np.abs(golden / 255 - without[..., :3]).mean())
    assert difference.mean() < mean and wrong < MAX_WRONG, (
        f"{name} differs: see {SHEETS / name}.png (golden, found, 4 × both)"
    )

"""Make a scene of hundreds of different assets, to measure loading: `python -m tools.make_models FOLDER market`.

It shows vessels in two rows, no two alike, and quick to make.
"""

from pathlib import Path

import numpy as np
from tools.make_models.model import Model, write_ply
from tools.make_models.noise import fractal
from tools.make_models.paint import mix
from tools.make_models.surfaces import lathe, rounded_profile

from depthwalk.files import write_bytes

_SEGMENTS = 160
_RINGS = 120
_SPACING = 3.0  # m

_SCENE = """version: 1
assets:
{assets}
objects:
{objects}
environment: {{ground: {{}}, sky: {{}}}}
camera: {{position: [0, 1.7, {end:g}], target: [0, 1, 0], fov: 60}}
"""


def vessel(seed: int) -> Model:
    """Make a jar, a bowl or a bottle, closed by a lid, about 1 m high and fluted; `seed` chooses shape and colours."""
    random = np.random.default_rng(seed)
    foot, belly, neck, lip = random.uniform((0.1, 0.2, 0.05, 0.08), (0.3, 0.45, 0.25, 0.35))
    height = random.uniform(0.7, 1.3)
    at = random.uniform((0.3, 0.7), (0.6, 0.85)) * height
    outside = rounded_profile([(foot, 0.0), (belly, at[0]), (neck, at[1]), (lip, height)], _RINGS)
    flutes, depth = int(random.integers(3, 25)), random.uniform(0, 0.06)
    model = lathe([[0.0, 0.0], *outside, [0.0, height]], _SEGMENTS, lambda theta, y: 1 + depth * np.cos(flutes * theta))
    light, dark = random.uniform(0.2, 0.9, (2, 3))
    return model.painted(mix(light, dark, 0.5 + fractal(model.positions, random.uniform(0.05, 0.3), seed)))


def write_market(folder: Path, count: int) -> None:
    """Write `count` vessels and `market.yaml`, in which they stand in two rows along z, to an existing folder."""
    assets, objects = [], []
    end = _SPACING * (count // 4 + 1)
    for number in range(count):
        write_ply(folder / f"vessel{number}.ply", vessel(number))
        assets.append(f"  vessel{number}: {{mesh: vessel{number}.ply, dpci: {{resolution: 256, layers: 2}}}}")
        x, z = (-2.0, 2.0)[number % 2], end - _SPACING * (number // 2 + 1)
        objects.append(f"  - {{asset: vessel{number}, position: [{x:g}, 0, {z:g}]}}")
    text = _SCENE.format(assets="\n".join(assets), objects="\n".join(objects), end=end)
    write_bytes(folder / "market.yaml", text.encode())

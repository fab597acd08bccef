"""Twin of shaders/output/tone.glsl: linear light (n, 3) of any strength to linear RGB (n, 3) that a screen shows."""

from collections.abc import Callable

import numpy as np

from depthwalk.colour import LUMINANCE
from depthwalk.types import Array

# AgX's narrower space, rows by what comes out, as Wrensch 2023 gives it.
_INTO = np.array(
    [
        [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
        [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
        [0.0423756549057051, 0.0784336, 0.879142973793104],
    ]
)
_DARKEST, _BRIGHTEST = -12.47393, 4.026069  # log2
_CURVE = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232]


def reinhard(light: Array) -> Array:
    """Reinhard et al. 2002, equation 3."""
    return light / (1 + light @ LUMINANCE)[:, None]


def aces(light: Array) -> Array:
    """Narkowicz 2015."""
    return light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14)


def agx(light: Array) -> Array:
    """Sobotka 2022, as Wrensch 2023 fits it."""
    stops = np.log2(np.maximum(light @ _INTO.T, 1e-10))
    curve = np.polyval(_CURVE, np.clip((stops - _DARKEST) / (_BRIGHTEST - _DARKEST), 0, 1))
    return np.maximum(curve @ np.linalg.inv(_INTO).T, 0) ** 2.2


TONES: dict[str, Callable[[Array], Array]] = {
    "none": lambda light: light,
    "reinhard": reinhard,
    "aces": aces,
    "agx": agx,
}

"""Map tones to what a screen can show, as the twin of shaders/output/tone.glsl.

Each operator compresses linear light (n, 3) of any strength to linear RGB (n, 3), of which a screen shows 0 to 1.
`TONES` holds the operators by the names of the setting `render.output.tone`; "none" leaves light as it is.
"""

from collections.abc import Callable

import numpy as np

from depthwalk.colour import LUMINANCE
from depthwalk.types import Array

# Linear RGB to the narrower space in which AgX applies its curve, as Wrensch 2023 gives it.
_AGX_FROM_RGB = np.array(
    [
        [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
        [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
        [0.0423756549057051, 0.0784336, 0.879142973793104],
    ]
)
_DARKEST, _BRIGHTEST = -12.47393, 4.026069  # log2 of the light at the curve's two ends
_CURVE = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232]  # Wrensch's polynomial, highest power first


def reinhard(light: Array) -> Array:
    """Divide `light` (n, 3), linear RGB, by 1 + L, where L is its luminance (Reinhard et al. 2002, equation 3).

    Luminance goes from 0 to below 1 in the result (n, 3), linear RGB; a saturated channel may still exceed 1.
    """
    return np.asarray(light / (1 + light @ LUMINANCE)[:, None])


def aces(light: Array) -> Array:
    """Apply a fit of the ACES film curve to each channel of `light` (n, 3), linear RGB.

    Returns (n, 3) linear RGB, from 0 to about 1. Source: Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
    """
    return light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14)


def agx(light: Array) -> Array:
    """Apply AgX (Sobotka 2022), a curve over 16.5 stops of brightness, to `light` (n, 3), linear RGB.

    The curve is the polynomial of Wrensch 2023, "Minimal AgX Implementation". Light is first converted to a narrower
    colour space, so that strong colours turn to white as they brighten, and converted back after the curve. Returns
    (n, 3) linear RGB, from 0 to about 1.
    """
    stops = np.log2(np.maximum(light @ _AGX_FROM_RGB.T, 1e-10))
    curve = np.polyval(_CURVE, np.clip((stops - _DARKEST) / (_BRIGHTEST - _DARKEST), 0, 1))
    return np.asarray(np.maximum(curve @ np.linalg.inv(_AGX_FROM_RGB).T, 0) ** 2.2)


TONES: dict[str, Callable[[Array], Array]] = {
    "none": lambda light: light,
    "reinhard": reinhard,
    "aces": aces,
    "agx": agx,
}

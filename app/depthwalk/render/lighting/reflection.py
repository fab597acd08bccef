"""Blur the sky as surfaces of growing roughness reflect it.

The light that a rough surface reflects is approximated by two factors (the split sum, Karis 2013, "Real Shading in
Unreal Engine 4"). One is the sky, averaged with the weights of GGX for a viewer straight above the surface; it depends
on the reflected direction and on roughness alone, so it is computed once here and looked up per pixel. The other is the
part of even light that a surface reflects, a table by roughness and angle.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.lighting.image_sky import ImageSky, bilinear, halved, texel_directions, without_sun
from depthwalk.render.lighting.sky import PaintedSky, Triple

DIELECTRIC = 0.04
"""Reflectance at normal incidence of what is not metal: that of a refractive index of 1.5, as in glTF."""
LEAST_ROUGHNESS = 0.08
"""Roughness below which highlights of sun and lamps get no smaller, since they would flicker."""
IMAGE_WIDTH = 1024  # texels across a picture of the sky as a mirror shows it, 0.35° each
LEAST_WIDTH = 512  # the same for painted skies and small pictures: what is sharp in it, rough surfaces show sharp, too
ROUGHEST_WIDTH = 16  # texels across the level of roughness 1
PARTS = 32  # rows and columns of the table of reflected parts
_FACETS = 32  # steps of the facets' inclination, and half as many of their azimuth, over which it is summed
_MOST_LIGHT = 65504.0  # that a half float holds


@dataclass(frozen=True, kw_only=True)
class ReflectedSky:
    """Hold the sky that surfaces reflect.

    Attributes
    ----------
    sky
        The sky.
    ground
        Linear RGB of what is below the horizon of a painted sky; pictures have their own ground.
    with_sun
        Whether the sun of a picture is reflected as a part of it, and does not light the scene by itself.
    """

    sky: PaintedSky | ImageSky
    ground: Triple = (0.0, 0.0, 0.0)
    with_sun: bool = True

    @property
    def key(self) -> Hashable:
        """Return a key that is equal for skies of which `levels` are equal; turn and intensity do not matter."""
        return (self.sky.image, self.with_sun) if isinstance(self.sky, ImageSky) else (self.sky, self.ground)

    def levels(self) -> tuple[NDArray[np.float16], ...]:
        """Compute the sky, not turned and of intensity 1, at rising roughness.

        Returns
        -------
        tuple
            (H, W, 3) float16, linear RGB, equirectangular as in `image_sky`, row 0 at the zenith. The first is what a
            mirror shows. Each further one is half as wide and of twice the α of GGX, down to `ROUGHEST_WIDTH` texels,
            of α = 1. Smaller ones complete the mip-maps.
        """
        level, levels = self._mirrored(), list[NDArray[np.float32]]()
        while level.shape[0] > 1:
            width = level.shape[1]
            alpha = ROUGHEST_WIDTH / width
            levels.append(blurred(level, alpha) if levels and alpha <= 1 else level)
            level = halved(level)
        return tuple(np.minimum(level, _MOST_LIGHT).astype(np.float16) for level in (*levels, level))

    def uniforms(self, levels: int) -> dict[str, Any]:
        """Return the uniforms of shaders/light/reflected_sky.glsl, without the sampler. levels: their number."""
        image = self.sky if isinstance(self.sky, ImageSky) else None
        return {
            "mirrored_turn": image.turn if image else 0.0,
            "mirrored_intensity": image.intensity if image else 1.0,
            "roughest": float(levels - int(np.log2(ROUGHEST_WIDTH))),
        }

    def _mirrored(self) -> NDArray[np.float32]:
        """Return the sky as a mirror shows it, (H, W, 3), W a power of two."""
        from depthwalk.ingest.sky_image import shrunk  # here, since few scenes have a picture

        if not isinstance(self.sky, ImageSky):
            height = LEAST_WIDTH // 2
            direction, _ = texel_directions(height, LEAST_WIDTH)
            above = direction[: len(direction) // 2]
            radiance = np.broadcast_to(np.array(self.ground, np.float32), (len(direction), 3)).copy()
            radiance[: len(above)] = self.sky.radiance(above)
            return radiance.reshape(height, LEAST_WIDTH, 3)
        stored = self.sky.image.levels
        width = 1 << int(np.log2(np.clip(stored[0].shape[1], LEAST_WIDTH, IMAGE_WIDTH)))
        finer = [level for level in stored if level.shape[1] >= width]
        picture = shrunk(finer[-1].astype(np.float32), width, width // 2) if finer else _enlarged(stored[0], width)
        if self.with_sun:
            return picture
        direction, weight = texel_directions(*picture.shape[:2])
        _, _, rest = without_sun(picture.reshape(-1, 3).astype(float), direction, weight)
        return rest.reshape(picture.shape).astype(np.float32)


def _enlarged(texels: NDArray[np.float16], width: int) -> NDArray[np.float32]:
    """Return an equirectangular picture (H, W, 3) at another width, filtered as the background shows it."""
    height = width // 2
    down, across = np.indices((height, width)) + 0.5
    return bilinear(texels, across.ravel() / width, down.ravel() / height).reshape(height, width, 3).astype(np.float32)


def blurred(radiance: NDArray[np.float32], alpha: float) -> NDArray[np.float32]:
    """Average a sky around each direction as GGX reflects it towards a viewer in that direction.

    Light l counts by D(h) · (n · l), with the facet's normal h between l and the viewer v = n. This depends only on
    the angle between l and n, so each pair of rows is a convolution over the azimuth, a product of Fourier series.

    Parameters
    ----------
    radiance
        (H, W, 3) equirectangular, H and W even.
    alpha
        α of GGX, above 0 to 1, not much below the size of a texel, radians.

    Returns
    -------
    NDArray[np.float32]
        (H, W, 3) averages.
    """
    from scipy.fft import dct, irfft, rfft

    height, width, _ = radiance.shape
    down = np.pi * (np.arange(height, dtype=np.float32) + 0.5) / height
    rows, weight = height // 2, np.sin(down)  # the lower half mirrors the upper one
    azimuth = 2 * np.pi * np.arange(width // 2 + 1, dtype=np.float32) / width
    cosine = np.sin(down[:rows, None]) * np.sin(down) * np.cos(azimuth)[:, None, None]
    cosine += np.cos(down[:rows, None]) * np.cos(down)
    spread = (1 + cosine) * np.float32((alpha * alpha - 1) / 2) + 1
    kernel = dct(np.maximum(cosine, 0) / (spread * spread), type=1, axis=0, overwrite_x=True)  # even in the azimuth
    kernel *= weight / (kernel[0] @ weight)[:, None]
    series = rfft(radiance, axis=1).transpose(1, 0, 2)
    parts = np.concatenate([series.real, series.imag], -1)
    found = np.concatenate([kernel @ parts, (kernel @ parts[:, ::-1])[:, ::-1]], 1)
    shown = irfft((found[..., :3] + 1j * found[..., 3:]).transpose(1, 0, 2), width, axis=1)
    return np.asarray(np.maximum(shown, 0), np.float32)


def reflected_parts() -> NDArray[np.float16]:
    """Sum up the part of even light that GGX reflects, with the masking of Heitz 2014 and Schlick's Fresnel factor.

    Returns
    -------
    NDArray[np.float16]
        (n, n, 2) for the roughness of each row and the cosine between normal and viewer of each column, both from 0 to
        1: a factor of the reflectance at normal incidence, and a summand. Facets are distributed as those that reflect
        (Karis 2013).
    """
    table = np.zeros((PARTS, PARTS, 2), np.float16)
    steps = np.maximum(np.arange(PARTS) / (PARTS - 1), 1e-3)
    share, turn = (np.arange(_FACETS) + 0.5) / _FACETS, 2 * np.pi * (np.arange(_FACETS // 2) + 0.5) / _FACETS
    facing = steps[:, None, None]  # the viewer is at (√(1 − facing²), 0, facing)
    for row, square in enumerate(np.maximum(steps, LEAST_ROUGHNESS) ** 4):  # α² of GGX
        upright = np.sqrt((1 - share) / (1 + (square - 1) * share))[:, None]  # of a facet's normal, by z
        incidence = np.sqrt(1 - facing**2) * np.sqrt(1 - upright**2) * np.cos(turn) + facing * upright
        lambert = 2 * incidence * upright - facing
        lit = np.maximum(lambert, 1e-9)
        masking = lit * np.sqrt(facing**2 * (1 - square) + square) + facing * np.sqrt(lit**2 * (1 - square) + square)
        part = np.where((lambert > 0) & (incidence > 0), 2 * lit * incidence / (upright * masking), 0)
        grazing = (1 - np.clip(incidence, 0, 1)) ** 5
        table[row] = np.stack([(part * (1 - grazing)).mean((1, 2)), (part * grazing).mean((1, 2))], -1)
    return table

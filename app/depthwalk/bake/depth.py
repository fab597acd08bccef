"""Choose how many layers an object's images need to hold everything that can be seen of it."""

from dataclasses import dataclass, replace

import numpy as np

from depthwalk.bake.baker import peeled_layers
from depthwalk.bake.images import Cylinder
from depthwalk.bake.params import BakeParams
from depthwalk.bake.placement import Placement, extent
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.sampling import Probes, footprints_by_layers, squared_texels
from depthwalk.limits import MAX_DPCI_LAYERS

_LEAST_GAIN = 0.1  # texels², mean over the surface, that all deeper layers together must gain


@dataclass(frozen=True, kw_only=True)
class Depth:
    """Hold how well images with a given number of layers would sample a surface.

    Means over the surface are weighted by how much of the sky sees it.

    Attributes
    ----------
    layers
        Surfaces along each ray.
    missing
        The part of the surface, 0 to 1, in no image.
    footprint
        The mean squared footprint, texels², see `squared_texels`.
    """

    layers: int
    missing: float
    footprint: float


def measure_depth(
    caster: RayCaster, probes: Probes, placement: Placement, cylinder: Cylinder, params: BakeParams
) -> list[Depth]:
    """Measure how well images of 1, 2, … `MAX_DPCI_LAYERS` layers would sample a surface, without baking them.

    Parameters
    ----------
    caster
        The whole mesh, which may hide parts of the surface, asset frame.
    probes
        Points of the surface, asset frame.
    placement
        The frame of the cylinder in the asset's.
    cylinder
        The volume that the images would enclose, in the frame of `placement`, metres.
    params
        How the images would be baked; its `layers` is ignored.

    Returns
    -------
    list
        The results for 1, 2, … layers, in this order.
    """
    texel = extent(cylinder) / params.resolution
    weights = probes.weight if probes.weight.any() else None  # a solid turned inside out is not visible at all
    numbers = range(1, MAX_DPCI_LAYERS + 1)
    peeled = [peeled_layers(replace(params, layers=layers), caster) for layers in numbers]
    found = footprints_by_layers(caster, probes, placement, cylinder, params, peeled)
    depths = []
    for layers, footprint in zip(numbers, found, strict=True):
        values = np.isinf(footprint), squared_texels(footprint, texel)
        missing, squared = np.average(values, axis=1, weights=weights).tolist()
        depths.append(Depth(layers=layers, missing=missing, footprint=squared))
    return depths


def deep_enough(depths: list[Depth]) -> Depth:
    """Choose the fewest layers with which images sample a surface about as well as with the most layers.

    Their mean squared footprint is less than a tenth of a texel² above that of the most layers.

    Parameters
    ----------
    depths
        The results for 1, 2, … layers, in this order, as `measure_depth` returns them; at least one.

    Returns
    -------
    Depth
        The first of `depths` that is good enough.
    """
    return next(depth for depth in depths if depth.footprint - depths[-1].footprint < _LEAST_GAIN)

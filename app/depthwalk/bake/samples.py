"""What one face of the cylinder sees of a mesh, however it was sampled."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.border import Samples
from depthwalk.bake.parallel import Map
from depthwalk.bake.raycast import Hits
from depthwalk.bake.surface import surface_at
from depthwalk.ingest.mesh import Mesh


@dataclass(frozen=True)
class FaceSamples:
    """The L layers of a face. samples: depth and the faces' own normals; normal: (L, H, W, 3) float32, unit, for
    shading; albedo: (L, H, W, 4) float32, linear RGB and specular strength. Both zero where empty."""

    samples: Samples
    normal: NDArray[np.float32]
    albedo: NDArray[np.float32]


def face_samples(mesh: Mesh, hits: Hits, size: int, each: Map = map) -> FaceSamples:
    """The samples of hits (L, size²) on `mesh`."""
    shape = (len(hits), size, size)
    normal, albedo = surface_at(mesh, hits, each)
    samples = Samples(hits.distance.reshape(shape), hits.normal.reshape(*shape, 3), hits.flipped.reshape(shape))
    return FaceSamples(samples, normal.reshape(*shape, 3), albedo.reshape(*shape, 4))

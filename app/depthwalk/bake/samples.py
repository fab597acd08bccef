"""Define the samples of a mesh on one face of the cylinder, whichever way they were taken."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.boundary_strip import Samples
from depthwalk.bake.normal_maps import NormalMaps
from depthwalk.bake.raycast import Hits
from depthwalk.bake.surface import surface_at
from depthwalk.bake.texture_coordinates import TexturedFaces, TexturePlaces, texture_places
from depthwalk.ingest.mesh import Mesh
from depthwalk.parallel import Map
from depthwalk.types import Array


@dataclass(frozen=True, kw_only=True)
class FaceSamples:
    """Hold the L layers of samples of one face, (H, W) texels each.

    Attributes
    ----------
    samples
        Depths, and the normals of the triangles hit.
    normal
        (L, H, W, 3) float32, unit, object frame, for shading; zero where empty.
    albedo
        (L, H, W, 4) float32, linear RGB and specular strength, or reflection code; zero where empty.
    places
        Positions of the samples in the mesh's texture; None if these are not kept.
    mapped_normal
        (L, H, W, 3) float32, `normal` turned by the mesh's normal maps; None if it has none.
    """

    samples: Samples
    normal: NDArray[np.float32]
    albedo: NDArray[np.float32]
    places: TexturePlaces | None = None
    mapped_normal: NDArray[np.float32] | None = None


def face_samples(
    mesh: Mesh,
    hits: Hits,
    shape: tuple[int, int],
    parallel_map: Map = map,
    textured: TexturedFaces | None = None,
    normal_maps: NormalMaps | None = None,
    area: Array | None = None,
) -> FaceSamples:
    """Return the samples of a face from the hits of its texels' rays.

    Parameters
    ----------
    mesh
        The mesh that was hit, object frame.
    hits
        (L, H · W) hits of each texel's ray, row by row.
    shape
        Height H and width W of the face's images, texels.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.
    textured
        The texture in which the samples are located; None for none.
    normal_maps
        The normal maps of the mesh; None if it has none.
    area
        (L, H · W) m², the surface that each hit stands for, over which normal maps are averaged, see `footprint_area`;
        None without normal maps.

    Returns
    -------
    FaceSamples
        L layers of (H, W) samples.
    """
    layers = (len(hits), *shape)
    normal, albedo = surface_at(mesh, hits, parallel_map)
    samples = Samples(
        depth=hits.distance.reshape(layers),
        facing=hits.normal.reshape(*layers, 3),
        flipped=hits.flipped.reshape(layers),
    )
    mapped = None
    if normal_maps is not None and area is not None:
        mapped = normal_maps.turned(hits, normal, area, parallel_map).reshape(*layers, 3)
    return FaceSamples(
        samples=samples,
        normal=normal.reshape(*layers, 3),
        albedo=albedo.reshape(*layers, 4),
        places=None if textured is None else texture_places(mesh, textured, hits, shape),
        mapped_normal=mapped,
    )

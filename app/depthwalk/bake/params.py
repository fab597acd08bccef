"""Define the bake parameters, which scene files, commands and the keys of cached files share.

Nothing here bakes, so that looking for baked files does not import the baker.
"""

from dataclasses import dataclass, fields
from typing import Literal

import numpy as np

from depthwalk.errors import InputError
from depthwalk.ingest.mesh import MOST_LEVELS
from depthwalk.limits import DEFAULT_DPCI_LAYERS, DEFAULT_DPCI_RESOLUTION, MAX_DPCI_PARTS

Method = Literal["raycast", "six-view", "paper"]
Layers = int | Literal["auto"]
Coordinates = Literal["auto", "never"]
Direction = tuple[float, float, float]
Axis = Literal["auto", "x", "y", "z"] | Direction
"""auto, an axis of the asset's frame, or a direction in it."""

# For the simplified levels of meshes.
RATIOS = tuple(4**level for level in range(1, MOST_LEVELS))  # the mesh's triangles over those of a level
FEWEST = 50  # triangles of a level, roughly
LOOKS = 3  # version of how levels get their normals and colours, and of what their errors mean

NAMED: dict[str, Direction] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True, kw_only=True)
class Refinements:
    """Choose what the baker does beyond the paper, as described in docs/baking.md.

    All are on, except where their effect is measured one by one (docs/ablation.md).

    Attributes
    ----------
    discontinuity_cut
        Whether to drop triangles that do not lie on the mesh, tested by rays.
    across_layers
        Whether a triangle's corners may be on different layers.
    boundary_strips
        Whether to add boundary strips, which complete the grids up to the edges of their surfaces.
    owners
        Whether each piece of surface is drawn only from the face that samples it best.
    box_faces
        Whether to add images of the upright faces of the box around the cylinder.
    """

    discontinuity_cut: bool = True
    across_layers: bool = True
    boundary_strips: bool = True
    owners: bool = True
    box_faces: bool = True


EVERYTHING = Refinements()
NOTHING = Refinements(**dict.fromkeys((field.name for field in fields(Refinements)), False))


@dataclass(frozen=True, kw_only=True)
class BakeParams:
    """Choose how a mesh is sampled.

    Attributes
    ----------
    resolution
        Side of every image, texels.
    layers
        How many surfaces along each ray to keep, each in its own image; auto: as many as a file may hold.
    method
        How the surfaces are sampled: by ray casting, or from the paper's six views; `paper`: from six views, with
        nothing beyond the paper.
    refinements
        What is done beyond the paper, with methods other than `paper`.
    coordinates
        Whether to keep the mesh's texture, and for each texel its texture coordinates; auto: if the texture is finer
        than the images. Only ray casting finds them.

    Raises
    ------
    InputError
        If the method cannot make that many layers.
    """

    resolution: int = DEFAULT_DPCI_RESOLUTION
    layers: Layers = DEFAULT_DPCI_LAYERS
    method: Method = "raycast"
    refinements: Refinements = EVERYTHING
    coordinates: Coordinates = "auto"

    def __post_init__(self) -> None:
        """Check that the method can make the layers."""
        if self.by_six_views and self.layers != 1:
            raise InputError(
                f"layers {self.layers}: method {self.method} sees one surface per ray; say 1, or use raycast"
            )

    @property
    def by_six_views(self) -> bool:
        """Return whether surfaces are sampled from six views, which see one surface per ray and have no box faces."""
        return self.method != "raycast"

    @property
    def keeps_coordinates(self) -> bool:
        """Return whether texture coordinates are kept where they pay off."""
        return self.coordinates == "auto" and not self.by_six_views


@dataclass(frozen=True, kw_only=True)
class ModelParams(BakeParams):
    """Choose how a mesh is baked: as in `BakeParams`, and in how many parts and about which axis.

    If `layers` is auto, images get as many layers as needed to hold what can be seen.

    Attributes
    ----------
    parts
        Largest number of parts that the mesh is split into; auto: as many as needed to sample the surface well.
    axis
        Axis of the cylinder, or of each part's, in the asset's frame; auto: the one that samples the surface best.

    Raises
    ------
    InputError
        For values out of range, and if the method cannot make that many layers.
    """

    parts: int | Literal["auto"] = 1
    axis: Axis = "y"

    def __post_init__(self) -> None:
        """Check the values."""
        super().__post_init__()
        if self.parts != "auto" and not 1 <= self.parts <= MAX_DPCI_PARTS:
            raise InputError(f"parts {self.parts}: must be 1 to {MAX_DPCI_PARTS}, or auto")
        if self.axis not in ("auto", *NAMED) and not 0 < np.linalg.norm(np.asarray(self.axis, float)) < np.inf:
            raise InputError(f"axis {self.axis}: must be a direction, not all of it 0")

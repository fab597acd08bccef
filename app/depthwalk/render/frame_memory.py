"""Define the kinds of pictures, and keep for each kind what one picture leaves to the next.

Besides frames, a window draws refined pictures for a viewer who stands still, and small pictures of the surroundings.
Each kind remembers separately what was in sight, and has its own impostor tiles.
"""

from dataclasses import dataclass

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.occlusion_phases import OcclusionPhases
from depthwalk.render.tile_atlas import TileAtlas, atlas_size
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.scene.render_settings import RenderSettings


@dataclass(frozen=True, kw_only=True)
class PictureKind:
    """Describe what pictures are for, and so what they may change for other pictures.

    Attributes
    ----------
    is_frame : whether it belongs to the sequence of frames: it decides which shadow maps there are, sets
        `Renderer.plan` and `Renderer.view`, and its steps are timed. Other pictures use the last frame's shadow maps.
    supersampled : whether a pixel has several samples, even where the settings ask for one.
    yields : whether it leaves memory and time to the frames: it releases no assets, keeps textures at the resolution
        that they have on the GPU, and lets shadow maps wait.
    """

    is_frame: bool
    supersampled: bool = False
    yields: bool = False


FRAME = PictureKind(is_frame=True)
"""What a window shows next, or a picture on its own."""

REFINED = PictureKind(is_frame=False, supersampled=True)
"""A more exact picture of the frame before, or a part of it (`render.still_picture`)."""

SURROUNDING = PictureKind(is_frame=False, yields=True)
"""A small picture in any direction from the viewer's place, of what frames may soon show (`reprojection.surround`)."""


class FrameMemory:
    """Own the occlusion phases and the tile atlas of frames of one kind.

    Parameters
    ----------
    device : the GPU that draws.
    settings : the render settings of the scene; they may change between frames.
    world : the objects of the scene.
    timers : measure the steps of the phases.

    Attributes
    ----------
    phases : decides which objects are drawn in which phase.
    """

    def __init__(self, device: Device, settings: RenderSettings, world: RenderWorld, timers: PassTimers) -> None:
        self.phases = OcclusionPhases(device, settings, world, timers)
        self._device = device
        self._atlas: TileAtlas | None = None

    def atlas(self, view: View, lit: bool) -> TileAtlas:
        """Return an atlas for the impostor tiles of `view`, `lit` or not; that of the last picture where it fits."""
        size = atlas_size(view.whole_size, self._device.limits.edge)
        if self._atlas is None or self._atlas.size != size or self._atlas.lit != lit:
            self.release_atlas()  # first, as there may not be memory for two
            self._atlas = TileAtlas(self._device, size, lit)
        return self._atlas

    def release_atlas(self) -> None:
        """Free the atlas; the next frame makes another."""
        if self._atlas is not None:
            self._atlas.release()
        self._atlas = None

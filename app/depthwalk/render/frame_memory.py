"""Say what a picture is for, and keep what pictures of one kind leave to the next ones of that kind.

A window draws frames and, beside them, pictures that are no frames: the refined one of a viewer who stands still, and
small ones of what lies around. Each kind remembers for itself what was in sight, and has impostor tiles of its own.
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
    """Say what pictures are for, and so what they may change for others.

    Attributes
    ----------
    is_frame : whether the next picture may be the one after it: it decides which shadow maps there are, sets
        `Renderer.plan` and `Renderer.view`, and its steps are timed. The others show the shadow maps of the last frame.
    supersampled : whether a pixel has several samples, however many the settings ask for.
    yields : whether it leaves memory and time to the frames: assets that others need stay on the GPU, textures are as
        fine as they happen to be there, and shadow maps that may wait do so.
    """

    is_frame: bool
    supersampled: bool = False
    yields: bool = False


FRAME = PictureKind(is_frame=True)
"""What a window shows next, or a picture on its own."""

REFINED = PictureKind(is_frame=False, supersampled=True)
"""A more exact picture of the frame before, or a part of it (`render.still_picture`)."""

SURROUNDING = PictureKind(is_frame=False, yields=True)
"""A small picture of any direction from where the viewer is, which frames may come to show (`render.surround`)."""


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
    phases : which objects are drawn when.
    """

    def __init__(self, device: Device, settings: RenderSettings, world: RenderWorld, timers: PassTimers) -> None:
        self.phases = OcclusionPhases(device, settings, world, timers)
        self._device = device
        self._atlas: TileAtlas | None = None

    def atlas(self, view: View, lit: bool) -> TileAtlas:
        """Return an atlas for the impostor tiles of `view`, `lit` or not; that of the last such frame where it fits."""
        size = atlas_size(view.whole_size, self._device.limits.edge)
        if self._atlas is None or self._atlas.size != size or self._atlas.lit != lit:
            self.release_atlas()  # should there be no memory for the next
            self._atlas = TileAtlas(self._device, size, lit)
        return self._atlas

    def release_atlas(self) -> None:
        """Free the atlas; the next frame makes another."""
        if self._atlas is not None:
            self._atlas.release()
        self._atlas = None

"""Keep what frames of one kind leave to the next ones: which objects were in sight, and the impostor tiles."""

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.occlusion_phases import OcclusionPhases
from depthwalk.render.tile_atlas import TileAtlas, atlas_size
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.scene.render_settings import RenderSettings


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
        size = atlas_size(view.whole_size, self._device.max_texture_size)
        if self._atlas is None or self._atlas.size != size or self._atlas.lit != lit:
            self.release_atlas()  # should there be no memory for the next
            self._atlas = TileAtlas(self._device, size, lit)
        return self._atlas

    def release_atlas(self) -> None:
        """Free the atlas; the next frame makes another."""
        if self._atlas is not None:
            self._atlas.release()
        self._atlas = None

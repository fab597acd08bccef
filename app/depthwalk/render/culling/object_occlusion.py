"""Test whether objects are hidden by what a frame has drawn so far: neighbours together first, then one by one."""

import numpy as np

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.culling.depth_readback import DepthReadback
from depthwalk.render.culling.occlusion_test import IsHidden, depth_test
from depthwalk.render.targets import Targets
from depthwalk.render.view.bounds import box_cylinders
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.render.world.spatial_cells import boxes_about
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.types import Mask, Rows

_NEIGHBOURS = 16  # objects that are first tested together


class ObjectOcclusion:
    """Read the depth buffer of a frame, and create the test of objects against it.

    Parameters
    ----------
    device : the GPU that draws, whose depth buffer is read.
    settings : the render settings of the scene; they may change between frames.
    world : the objects of the scene.
    timers : measure the time of the GPU, "occlusion_depth"; the caller measures that of the CPU.
    """

    def __init__(self, device: Device, settings: RenderSettings, world: RenderWorld, timers: PassTimers) -> None:
        self._device, self._settings, self._world, self._timers = device, settings, world, timers
        self._readback: DepthReadback | None = None  # created when there is something to cull

    def drawn(self, view: View, targets: Targets) -> "Occluders":
        """Return the occluders that are drawn so far. Waits until the GPU has drawn them.

        Parameters
        ----------
        view : the view of the picture, near and far plane fitted.
        targets : the textures that the picture is drawn into.
        """
        lod, warp = self._settings.lod, self._settings.warp
        if self._readback is None:
            self._readback = DepthReadback(self._device, view.size)
        with self._timers.measure_within("occlusion_depth"):
            self._readback.reduce(targets)
        with self._timers.waiting():
            farthest = self._readback.read()
        # Tiles and geometry may be coarser than pixels. Parallax of reused tiles adds no margin: a hidden object that
        # its displaced tile would show beside its occluder is rightly left out.
        margin = max(1, 1 / warp.tile_scale, lod.allowed_error)
        return Occluders(depth_test(farthest, self._readback.side, view, margin), self._world)

    def resized(self) -> None:
        """Release what depends on the size of the targets; must be called whenever that size changes."""
        if self._readback is not None:
            self._readback.release()
        self._readback = None


class Occluders:
    """Test what is hidden by the depth that was read; valid until the next depth is read.

    Parameters
    ----------
    is_hidden : the test of cylinders against that depth.
    world : the objects of the scene.
    """

    def __init__(self, is_hidden: IsHidden, world: RenderWorld) -> None:
        self.hide_cylinders, self._world = is_hidden, world

    def hide(self, rows: Rows) -> Mask:
        """Return which (m,) of the objects `rows` (m,) are hidden, each tested by its cylinder."""
        return self.hide_cylinders(self._world.cylinders(rows)) if len(rows) else np.zeros(0, bool)

    def hide_neighbours(self, rows: Rows) -> Mask:
        """Return which (m,) of the objects `rows` (m,) are hidden; neighbours must be close together in `rows`.

        Boxes about several objects are tested first, then single objects where a box is not hidden.
        """
        boxes = box_cylinders(*boxes_about(self._world.bounds(), rows, _NEIGHBOURS))
        hidden = np.repeat(self.hide_cylinders(boxes), _NEIGHBOURS)[: len(rows)]
        left = (~hidden).nonzero()[0]
        hidden[left] = self.hide(rows[left])
        return hidden

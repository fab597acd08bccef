"""Run the passes of a frame in order and time each; neighbouring pixel passes share one program where possible."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.antialiasing.modes import sample_views
from depthwalk.render.declared_targets import declared
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.pass_groups import neighbours
from depthwalk.render.pixel_pass import DrawnPass, PixelPrograms
from depthwalk.render.pixel_source import ColourFunctions, PixelSource
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.render_settings import RenderSettings

_END = object()  # a pass has no further part


class PassSequence:
    """Own the passes of a renderer, and run those that have anything to draw.

    Parameters
    ----------
    device : the GPU, whose context must be current.
    settings : the render settings of the scene; they may change between frames.
    timers : measure each pass, under its name.
    passes : the passes in their order, which are attached to the GPU.

    Attributes
    ----------
    passes : the passes in their order; one that is removed from the list is no longer drawn.
    """

    def __init__(
        self, device: Device, settings: RenderSettings, timers: PassTimers, passes: Sequence[Pass[Any]]
    ) -> None:
        self._settings, self._timers = settings, timers
        self._declared: dict[Pass[Any], Targets] = {}  # the targets as each pass may use them
        self._gl = device.scope("view")
        self._view_block = ViewBlock(self._gl, PICTURE_VIEW)
        self._pixel_programs = PixelPrograms(self._gl)
        self.passes: list[Pass[Any]] = []
        try:
            for pass_ in passes:
                pass_.attach(device)
                self.passes.append(pass_)
        except BaseException:
            self.release()
            raise

    def views(self, view: View) -> list[View]:
        """Return the views of the frames that make up a picture of `view`, as the passes ask for them."""
        views = [view]
        for pass_ in self.passes:
            if type(pass_).views is Pass.views:  # the default, a picture of one frame
                continue
            views = [seen for whole in views for seen in pass_.views(whole, pass_.params_in(self._settings))]
        return views

    def use(self, targets: Targets) -> None:
        """Draw into `targets` from now on. Raises ValueError where a pass declares a target that they lack."""
        self._declared = {pass_: declared(targets, pass_.name, pass_.reads, pass_.writes) for pass_ in self.passes}
        for pass_ in self.passes:
            pass_.resize(targets.size)

    def draw_objects(self, frame: Frame) -> Iterator[str]:
        """Run the passes that draw objects, for one phase of a frame; yield names as `finish` does."""
        drawn = {None, *frame.plan.height_fields, *frame.plan.captured}
        passes = [pass_ for pass_ in self.passes if pass_.draws_objects and pass_.representation in drawn]
        yield from self._draw(passes, frame, frozenset())

    def finish(self, frame: Frame, keeps: frozenset[str]) -> Iterator[str]:
        """Run the other passes: those that are `per_sample` once for each of a pixel's samples, the others once.

        Parameters
        ----------
        frame : what to draw.
        keeps : names of targets that are read after the frame, see `Renderer`.

        Yields
        ------
        The name of each pass after it ran and between its parts; all names, where several share a program.
        """
        passes = [pass_ for pass_ in self.passes if not pass_.draws_objects]
        if frame.common.aa.shown:
            passes.sort(key=lambda pass_: pass_.blends_shown)  # stable: the others keep their order
        if frame.targets.samples == 1:
            yield from self._draw(passes, frame, keeps)
            return
        for per_sample, run in groupby(passes, lambda pass_: pass_.per_sample):
            together = list(run)
            views = sample_views(frame.view, frame.targets.offsets) if per_sample else [frame.view]
            for number, seen in enumerate(views):
                yield from self._draw(together, replace(frame, view=seen, sample=number), keeps)

    def _draw(self, passes: Sequence[Pass[Any]], frame: Frame, keeps: frozenset[str]) -> Iterator[str]:
        """Run those of `passes` that have anything to draw, neighbours in one program where possible."""
        self._view_block.show(frame.view)
        groups = neighbours(self._enabled(passes, frame), self.passes, keeps if self._settings.fused else None)
        for group in groups:
            name, parts = " + ".join(drawn.pass_.name for drawn in group), self._parts(group)
            unfinished = True
            while unfinished:
                with self._timers.measure(name):
                    unfinished = next(parts, _END) is not _END
                if self._timers.may_be_long:  # wait for each part, lest a driver's watchdog end all of them as one
                    self._gl.device.context.finish()
                yield name

    def _parts(self, group: Sequence[DrawnPass]) -> Iterator[None]:
        """Return an iterator that draws a group of `neighbours`, part by part."""
        pass_, frame, params = group[0]
        if len(group) == 1:
            return pass_.parts(frame, params)
        if isinstance(pass_, PixelSource):
            return pass_.parts_with(frame, params, ColourFunctions.of(group[1:]))
        return self._pixel_programs.parts(group)

    def _enabled(self, passes: Sequence[Pass[Any]], frame: Frame) -> Iterator[DrawnPass]:
        """Yield those of `passes` that have anything to draw, each with the targets that it declares."""
        for pass_ in passes:
            drawn = DrawnPass(pass_, frame.with_targets(self._declared[pass_]), pass_.params_in(self._settings))
            if pass_.enabled(drawn.frame, drawn.params):
                yield drawn

    def forget_assets(self) -> None:
        """Let passes drop what refers to the buffers of assets, which are about to be freed."""
        for pass_ in self.passes:
            pass_.forget_assets()

    def release(self) -> None:
        """Free everything on the GPU. The passes may then serve another renderer."""
        for pass_ in self.passes:
            pass_.release()
        self._gl.release()

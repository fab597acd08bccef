"""Find the object that the user wants to inspect, and hold what the last frame says about it."""

from dataclasses import dataclass

from pyglm import glm

from depthwalk.render.object_ids import object_at
from depthwalk.render.object_report import ImpostorReport, ObjectReport, report_object
from depthwalk.render.passes.object_id import ObjectIdPass
from depthwalk.render.renderer import Renderer
from depthwalk.walk.atlas_view import AtlasView

NOTHING_HERE = "No object under the mouse to inspect"


@dataclass
class Inspected:
    """Hold the inspected object of a scene.

    Attributes
    ----------
    number
        The object's row in `Scene.objects`; None while nothing is inspected.
    report
        How the last frame drew it; None before that is known.
    point
        A surface point, metres, world, whose object is to be inspected: the next frame tells which it is. None while
        none is sought.
    """

    number: int | None = None
    report: ObjectReport | None = None
    point: glm.dvec3 | None = None

    @property
    def impostor(self) -> ImpostorReport | None:
        """Return the largest impostor by which the last frame drew the object; None if there was none."""
        drawn = () if self.report is None else self.report.impostors
        return max(drawn, key=lambda impostor: impostor.tile[2] * impostor.tile[3], default=None)

    def tile(self, renderer: Renderer) -> tuple[int, int, int, int] | None:
        """Return where that impostor lies in the atlas, see `ImpostorReport`; None if there is none.

        Nor is there one without reuse: later phases of the frame may have drawn over it.
        """
        if self.impostor is None or not renderer.settings.warp.reuse_error:
            return None
        return self.impostor.tile

    def seek(self, renderer: Renderer, point: glm.dvec3 | None) -> None:
        """Let the next frame of `renderer` tell which object `point` belongs to; None ends the inspection."""
        self.point = point
        if point is None:
            self.number = self.report = None
        else:
            _ids_of(renderer).requested = True

    def update(self, renderer: Renderer, atlas_view: AtlasView) -> bool:
        """Take up what a frame says about the object, or about `point`.

        Parameters
        ----------
        renderer
            The renderer, which has just finished the frame.
        atlas_view
            Where the tile of the object's largest impostor is painted.

        Returns
        -------
        bool
            Whether there was nothing to inspect, neither before nor at `point`.
        """
        misses = False
        if self.point is not None and (ids := _ids_of(renderer)).has_drawn:
            found = object_at(renderer, ids, self.point)
            misses = found is None and self.number is None
            self.number, self.point, ids.requested = None if found == self.number else found, None, False
        self.report = None if self.number is None else report_object(renderer, self.number)
        if (tile := self.tile(renderer)) is not None and renderer.targets is not None:
            atlas_view.draw_tile(renderer.targets, tile)
        return misses


def _ids_of(renderer: Renderer) -> ObjectIdPass:
    """Return the pass of a renderer that finds which mesh a pixel shows; `SceneLoader` adds it."""
    return next(pass_ for pass_ in renderer.passes if isinstance(pass_, ObjectIdPass))

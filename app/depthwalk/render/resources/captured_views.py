"""Keep captured views of meshes on the GPU, by the number of the asset and the directions that they were seen from."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple

import moderngl

from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.gpu.device import Scope
from depthwalk.render.resources.reflections import of_highlight

Capture = Callable[[int, CaptureParams], CapturedViews | None]


class _Request(NamedTuple):
    """Identify views: the asset, and the set of directions."""

    asset: int
    directions: str


@dataclass(frozen=True, kw_only=True)
class ViewTextures:
    """Hold the captured views of an asset on the GPU, whose GL objects belong to the asset store.

    Attributes
    ----------
    params
        How they were captured.
    colour, surface
        A layer for each direction, see `CapturedViews`, with mip-maps.
    uniforms
        The uniforms of shaders/common/captured_box.glsl and captured_views.glsl, by name.
    is_unlit
        Whether the object is shown without light.
    reflects
        Whether the object reflects the sky.
    """

    params: CaptureParams
    colour: moderngl.TextureArray
    surface: moderngl.TextureArray
    uniforms: dict[str, Any]
    is_unlit: bool
    reflects: bool

    @property
    def bytes(self) -> int:
        """Return how many bytes of GPU memory the textures take, with their mip-maps."""
        return int(8 * self.params.views * self.params.resolution**2 * 4 / 3)


class CapturedViewStore:
    """Upload captured views when they are first drawn, and own their GL objects.

    Parameters
    ----------
    gl
        The scope of the asset store, which owns the GL objects.
    capture
        Returns the views of an asset's mesh; None where it has none.
    """

    def __init__(self, gl: Scope, capture: Capture) -> None:
        self._gl, self._capture = gl, capture
        self._drawn: dict[_Request, ViewTextures] = {}
        self._making: dict[_Request, tuple[CaptureParams, Future[CapturedViews | None]]] = {}
        self._threads: ThreadPoolExecutor | None = None  # a single thread, created on first use

    @property
    def bytes(self) -> int:
        """Return how many bytes of GPU memory all views take."""
        return sum(views.bytes for views in self._drawn.values())

    @property
    def has_unlit(self) -> bool:
        """Return whether any views are of an object that is shown without light."""
        return any(views.is_unlit for views in self._drawn.values())

    @property
    def reflects(self) -> bool:
        """Return whether any views are of an object that reflects the sky."""
        return any(views.reflects for views in self._drawn.values())

    @property
    def is_busy(self) -> bool:
        """Return whether any views are still being captured in the background."""
        return bool(self._making)

    def views(self, asset: int, params: CaptureParams, wait: bool) -> ViewTextures | None:
        """Return the views of an asset, capturing and uploading them if necessary.

        Parameters
        ----------
        asset
            The number of the asset.
        params
            How it is captured.
        wait
            Whether to wait for the capture; otherwise a thread captures them in the background.

        Returns
        -------
        ViewTextures | None
            The views; until they are captured, earlier ones from the same directions with other params, or None.

        Raises
        ------
        LookupError
            Where the asset has no mesh.
        """
        request = _Request(asset, params.directions)
        drawn = self._drawn.get(request)
        if drawn is not None and drawn.params == params:
            return drawn
        if wait:
            return self._show(request, params, self._capture(asset, params))
        making = self._making.get(request)
        if making is None:
            self._threads = self._threads or ThreadPoolExecutor(1, "captures")
            self._making[request] = params, self._threads.submit(self._capture, asset, params)
        elif making[1].done():
            del self._making[request]
            return self._show(request, making[0], making[1].result())
        return drawn

    def _show(self, request: _Request, params: CaptureParams, views: CapturedViews | None) -> ViewTextures:
        """Upload `views`, replacing earlier ones for the same `request`."""
        if views is None:
            raise LookupError(f"asset {request.asset} has no mesh")
        if (before := self._drawn.pop(request, None)) is not None:
            self._gl.free(before.colour, before.surface)
        self._drawn[request] = made = upload_views(self._gl, views, params)
        return made

    def forget(self) -> None:
        """Drop all views, because their scope has been released, and captures in progress."""
        if self._threads is not None:
            self._threads.shutdown(wait=False, cancel_futures=True)
        self._threads = None
        self._drawn.clear()
        self._making.clear()


def upload_views(gl: Scope, views: CapturedViews, params: CaptureParams) -> ViewTextures:
    """Upload captured views into a scope.

    Parameters
    ----------
    gl
        The scope that owns the textures.
    views
        The views.
    params
        How they were captured.

    Returns
    -------
    ViewTextures
        The views on the GPU.
    """
    size = params.resolution, params.resolution, params.views
    uniforms = {
        "box_centre": tuple(views.centre.tolist()),
        "box_half_size": tuple(views.half_size.tolist()),
        "sphere_radius": views.radius,
        "specular": views.specular,
        "shininess": views.shininess,
    }
    if views.reflection is not None:
        uniforms["reflection"] = of_highlight(views.reflection)
    return ViewTextures(
        params=params,
        colour=gl.filtered_array(size, 4, views.colour.tobytes()),
        surface=gl.filtered_array(size, 4, views.surface.tobytes()),
        uniforms=uniforms,
        is_unlit=views.is_unlit,
        reflects=views.reflection is not None,
    )

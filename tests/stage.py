"""A renderer that tests ask what it found on its way to a picture."""

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import DTypeLike, NDArray

from depthwalk.bake.images import BakedObject
from depthwalk.bake.model import BakedModel
from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Mesh
from depthwalk.reference.gbuffer import unpacked_surfaces
from depthwalk.render.frame import Pass
from depthwalk.render.lod.selection import error_at_a_metre
from depthwalk.render.passes.shadows import ShadowsPass
from depthwalk.render.renderer import Renderer
from depthwalk.render.resources.library import Library
from depthwalk.render.shadows.cascades import Cascade
from depthwalk.render.shadows.casters import ShadowMap
from depthwalk.render.shadows.shadow_atlas import ShadowAtlas
from depthwalk.render.shadows.spot_maps import Spot
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from shapes import ShapeLibrary
from studio import Studio

SIZE = (240, 180)
WALK_SIZE = 160, 120


def view_of(
    position: tuple[float, float, float] = (0.0, 1.6, 5.0),
    target: tuple[float, float, float] = (0.0, 1.0, 0.0),
    far: float = 60.0,
) -> View:
    return View(Camera(position, target, 0.9), SIZE, near=0.1, far=far)


def set_all(settings: RenderSettings, values: Mapping[str, object]) -> None:
    """Set render settings by their names, within a group as `light.mode`."""
    for key, value in values.items():
        group, _, name = key.rpartition(".")
        setattr(getattr(settings, group) if group else settings, name, value)


class OnScreen:
    """A renderer of one scene, and a screen."""

    def __init__(
        self,
        device: Device,
        scene: Scene,
        library: Library,
        size: tuple[int, int] = SIZE,
        passes: Sequence[Pass[Any]] | None = None,
    ) -> None:
        self.scope = device.scope("stage")
        self.screen = self.scope.framebuffer([self.scope.texture(size, 4)])
        self.renderer = Renderer(device, scene, library, passes)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.renderer.release()
        self.scope.release()

    @property
    def counts(self) -> dict[str, float]:
        assert self.renderer.plan is not None
        return self.renderer.plan.counts

    def draw(self, view: View, transparent: bool = False) -> dict[str, float]:
        self.renderer.render(view, self.screen, transparent)
        return self.counts

    def pixels(self) -> NDArray[np.int64]:
        """(h, w, 3), lowest row first."""
        width, height = self.screen.size
        shown = np.frombuffer(self.screen.read(components=3, alignment=1), np.uint8)
        return shown.reshape(height, width, 3).astype(np.int64)

    def true(self, camera: Camera) -> NDArray[np.int64]:
        """What a frame shows, in the place of which something else may be shown."""
        self.draw(View(camera, self.screen.size))
        return self.pixels()


class Stage(OnScreen):
    """sun: whether it casts shadows."""

    def __init__(self, studio: Studio, scene: Scene, library: Library, sun: bool = True) -> None:
        super().__init__(studio.device, scene, library)
        self.renderer.keeps = frozenset({"shadow", "lit"})
        scene.render.shadows.enabled = sun

    def read(self, name: str, dtype: DTypeLike, components: int) -> NDArray[Any]:
        """A target (H, W, components), row 0 at the bottom."""
        data = getattr(self.renderer.targets, name).read(alignment=1)
        return np.frombuffer(data, dtype).reshape(*SIZE[::-1], components)

    def share(self) -> Array:
        return self.read("shadow_texture", np.uint8, 1)[..., 0] / 255

    def lit(self) -> Array:
        """Linear (H, W, 3)."""
        return self.read("lit_texture", np.float16, 4)[..., :3].astype(float)

    def points(self) -> Array:
        """World (H, W, 3), far below where nothing is."""
        view = self.renderer.view
        assert view is not None
        near, far = view.depth_range
        depth = self.read("depth", np.float32, 1)[..., 0].astype(float)
        with np.errstate(divide="ignore"):
            forward = np.where(depth < 1, near * far / (far - depth * (far - near)), np.inf)
        x, y = ((np.arange(n) + 0.5) / n * 2 - 1 for n in SIZE)
        screen = np.stack(np.broadcast_arrays(x[None], y[:, None], 1.0), -1)
        with np.errstate(invalid="ignore"):
            point = view.position + forward[..., None] * (screen @ view.ray_from_screen.T)
        return np.where(forward[..., None] < np.inf, point, -1e6)

    def normals(self) -> Array:
        """World (H, W, 3), unit."""
        words = self.read("surface", np.uint32, 2)
        return unpacked_surfaces(words.reshape(-1, 2)).normal.reshape(*words.shape[:2], 3)

    def raised(self) -> Array:
        """`points` along their normals by as much as what the picture shows may be off."""
        view, point = self.renderer.view, self.points()
        assert view is not None
        forward = (point - view.position) @ view.axes[2]
        return point + self.normals() * (error_at_a_metre(view, self.renderer.settings.lod) * forward)[..., None]

    def maps(self, lamps: bool = False) -> dict[int, tuple[Cascade | Spot, Array]]:
        """What maps see, by tile, and their depths, from the pass itself."""
        atlas = self._atlas(lamps)
        assert atlas.texture is not None
        depth = np.frombuffer(atlas.texture.read(), np.float32).reshape(atlas.texture.size[::-1])
        found = {}
        for tile, shown in atlas._held.items():
            side = shown.view.resolution
            x, y = tile % atlas._columns * side, tile // atlas._columns * side
            found[tile] = shown.view, depth[y : y + side, x : x + side]
        return found

    def shadow_maps(self) -> list[ShadowMap]:
        """What the sun's maps hold, the nearest first."""
        return [shown for _, shown in sorted(self._atlas()._held.items())]

    def _atlas(self, lamps: bool = False) -> ShadowAtlas:
        held = next(each for each in self.renderer.passes if isinstance(each, ShadowsPass))
        return held._of_lamps if lamps else held._of_sun


class Walk(OnScreen):
    """One whose frames wait for nothing longer than `seconds`; None: for all."""

    def __init__(self, device: Device, scene: Scene, library: Library, seconds: float | None) -> None:
        super().__init__(device, scene, library, WALK_SIZE)
        self.renderer.upload_seconds = seconds

    def look(self, camera: Camera) -> None:
        self.draw(View(camera, WALK_SIZE))


class SlowLibrary(ShapeLibrary):
    """Reads a mesh when it may, and not more than once."""

    def __init__(
        self,
        meshes: Sequence[Mesh | None],
        baked: Sequence[BakedObject | BakedModel | None] | None = None,
        kept: bool = True,
        resolution: int = 64,
        layers: int | Literal["auto"] = 2,
    ) -> None:
        super().__init__(meshes, baked, kept, resolution, layers)
        self.may, self.broken = threading.Event(), False
        self.read: list[int] = []
        self.forgotten: list[int] = []

    def mesh(self, asset: int) -> Mesh | None:
        if threading.current_thread() is not threading.main_thread():
            assert self.may.wait(20)
            self.read.append(asset)
            if self.broken:
                raise InputError("ball.ply: has gone")
        return super().mesh(asset)

    def forget_mesh(self, asset: int) -> None:
        self.forgotten.append(asset)


NEAR, AWAY = Camera((0, 0.5, 1.2), (0, 0.5, 0), 0.9), Camera((0, 0.5, 40.0), (0, 0.5, 0), 0.9)


def draws_until(walk: Walk, done: Callable[..., object]) -> None:
    for _ in range(2000):
        walk.look(NEAR)
        if done():
            return
        threading.Event().wait(0.005)
    raise AssertionError("the mesh never came")

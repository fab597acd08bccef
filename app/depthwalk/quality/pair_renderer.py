"""Draw one object as its mesh and as its depth images, from the same views under the same light."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.cooked import cooked_objects
from depthwalk.bake.capture import capture_views
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.bake.model import BakedModel
from depthwalk.cook.cluster_builder import build_clusters
from depthwalk.cook.cook import CookedObject, CookOptions
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.quality.views import Viewpoint, bounding_sphere, view_of
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.scene.arrays import Nodes, Objects, Representation
from depthwalk.scene.environment import Environment
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.scene.similarity import identities

BACKGROUND = (0.5, 0.5, 0.5)  # sRGB; favours neither bright nor dark surfaces


@dataclass(frozen=True)
class RgbdPicture:
    """Hold one picture, row 0 at the top.

    Attributes
    ----------
    pixels
        (H, W, 3) uint8, sRGB, over `BACKGROUND`.
    distance
        (H, W) float32, metres along the view axis, +inf where there is nothing.
    """

    pixels: NDArray[np.uint8]
    distance: NDArray[np.float32]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """Return which pixels show the object, (H, W) bool."""
        return np.isfinite(self.distance)


@dataclass(frozen=True)
class Pair:
    """Hold two pictures of one view.

    Attributes
    ----------
    mesh
        The mesh.
    dpci
        Its depth images.
    """

    mesh: RgbdPicture
    dpci: RgbdPicture


class PairRenderer:
    """Draw a mesh and its depth images from the same views. Use it in a `with` block, which frees its GPU memory.

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.
    baked
        The depth images of the mesh.
    settings
        How both are rendered; the settings are copied.
    size
        Width and height of the pictures, pixels.

    Attributes
    ----------
    size
        Width and height of the pictures, pixels.

    Raises
    ------
    GpuError
        If no OpenGL 3.3 context can be created.
    """

    def __init__(self, mesh: Mesh, baked: BakedModel, settings: RenderSettings, size: tuple[int, int]) -> None:
        self.size = size
        self._sphere = bounding_sphere(mesh)
        self._most_bytes = 0
        library = _OneObject(mesh, baked)
        scene = one_asset_scene(settings, Environment(background=BACKGROUND))  # with the default light
        self._headless = HeadlessRenderer(scene, library, size, Representation.DPCI)

    def __enter__(self) -> "PairRenderer":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._headless.release()

    def pair(self, viewpoint: Viewpoint) -> Pair:
        """Draw the mesh and its depth images from `viewpoint`, and return the two pictures."""
        return Pair(self._shot(viewpoint, Representation.MESH), self._shot(viewpoint, Representation.DPCI))

    @property
    def driver(self) -> str:
        """Return the GL driver's name."""
        return self._headless.device.renderer

    @property
    def gpu_bytes(self) -> int:
        """Return the most GPU memory that the depth images took in any picture, bytes: buffers, textures, mip-maps."""
        return self._most_bytes

    def _shot(self, viewpoint: Viewpoint, representation: Representation) -> RgbdPicture:
        self._headless.renderer.world.representation = representation
        view = view_of(self._sphere, viewpoint, self.size)
        self._headless.draw(view)
        if representation is Representation.DPCI:
            self._most_bytes = max(self._most_bytes, self._headless.renderer.assets.gpu_bytes)
        return RgbdPicture(self._headless.pixels()[..., :3].copy(), self._headless.distances())


class _OneObject:
    """Provide a single asset in memory as a library (`render.resources.library.Library`)."""

    def __init__(self, mesh: Mesh, baked: BakedModel) -> None:
        self._mesh, self._baked = mesh, baked

    def __len__(self) -> int:
        return 1

    def has_baked(self, asset: int) -> bool:
        return True

    def is_shipped_cooked(self, asset: int) -> bool:
        """Return whether the asset exists only in cooked form: never."""
        return False

    def has_height_field(self, asset: int) -> bool:
        return False

    def has_mesh(self, asset: int) -> bool:
        return True

    def bake_missing(self, assets: Sequence[int]) -> None:
        """Do nothing: the depth images are already baked."""

    def key(self, asset: int) -> str:
        return ""

    def baked(self, asset: int) -> BakedModel:
        return self._baked

    def cooked(self, asset: int, options: CookOptions, *, again: bool = False) -> tuple[CookedObject, ...]:
        return cooked_objects(lambda: "", lambda: self._baked, options, again=again)

    def preview(self, asset: int) -> None:
        """Return None: the mesh is in memory already."""

    def forget_preview(self, asset: int) -> None:
        """Do nothing, as there is none."""

    def drawn_mesh(self, asset: int) -> Mesh:
        """Return the mesh."""
        return self.mesh(asset)

    def mesh(self, asset: int) -> Mesh:
        return self._mesh

    def mesh_levels(self, asset: int) -> tuple[MeshLevel, ...]:
        return (MeshLevel(self._mesh, 0.0),)

    def mesh_clusters(self, asset: int) -> MeshClusters:
        return build_clusters(self._mesh)

    def captured_views(self, asset: int, params: CaptureParams) -> CapturedViews:
        return capture_views(self._mesh, params)

    def translucent_mesh(self, asset: int) -> Mesh | None:
        return self._mesh if self._mesh.is_translucent else None

    def forget_mesh(self, asset: int) -> None:
        """Do nothing: the mesh is kept."""

    def texture(self, path: Path) -> NDArray[np.uint8]:
        raise LookupError(f"the scene of one object names no textures: {path}")

    def sky_image(self, path: Path) -> NDArray[np.float32]:
        raise LookupError(f"the scene of one object has no sky: {path}")


def one_asset_scene(settings: RenderSettings, environment: Environment, *others: tuple[float, float, float]) -> Scene:
    """Return a scene with an object, asset 0 of a library, upright at the origin.

    Parameters
    ----------
    settings
        How the scene is rendered; the settings are copied.
    environment
        Light, background and ground of the scene.
    *others
        Positions of further objects of the same asset, metres, world.

    Returns
    -------
    Scene
        The scene, without a camera.
    """
    places, none = np.array([(0, 0, 0), *others], np.float32), np.zeros(0, np.int32)
    count = len(places)
    return Scene(
        path=Path(),
        assets=(),  # the library has it
        objects=Objects(
            asset=np.zeros(count, np.int32),
            position=places,
            rotation=np.tile(np.array([0, 0, 0, 1], np.float32), (count, 1)),
            scale=np.ones(count, np.float32),
            representation=np.full(count, Representation.DPCI, np.uint8),
        ),
        nodes=Nodes(
            name=(),
            parent=none,
            depth=none,
            end=none,
            first_object=none,
            object_count=none,
            angles=np.zeros((0, 3)),
            local=identities(0),
            world=identities(0),
        ),  # nothing moves
        instances=identities(count, np.float32),
        owner=np.zeros(count, np.int32),
        environment=environment,
        camera=None,
        render=settings.model_copy(deep=True),
    )

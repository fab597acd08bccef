"""Bake and cook the assets of a scene in the background of a walk, so that no frame waits for them.

A thread looks up assets in the cache, one after the other. Missing ones are baked and cooked into the cache by other
processes. The drawing program asks `is_cooked` for what it needs, in the order of need, and calls `poll` once per
frame. `prefetch` asks before there is a window, so that files are read while the window is created.
"""

import logging
import threading
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from depthwalk.assets.bake_pool import BakePool
from depthwalk.assets.demand import cook_options, nearest_first, requested_representations
from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.progress import Batch, Progress
from depthwalk.cook.cook import CookedObject, CookOptions, HeldArrays, Prefetcher
from depthwalk.cook.cooked_file import find_cooked, read_cooked
from depthwalk.errors import InputError, UnbakableError
from depthwalk.ingest.mesh import Mesh
from depthwalk.scene.arrays import OF_MESH, Representation
from depthwalk.scene.scene import Asset, Scene

log = logging.getLogger(__name__)

_MOST_HELD = 16  # preloaded objects, of some 10 MB each

Objects = tuple[CookedObject, ...]
_Request = tuple[int, CookOptions]


class BackgroundLibrary(SceneLibrary):
    """Provide the assets of a scene as `SceneLibrary` does, but report which are ready and prepare others meanwhile.

    So a program can draw frames, with meshes in place of depth images, until the depth images have been baked.

    Attributes
    ----------
    failures
        Messages about assets whose depth images cannot be made, oldest first; the caller may clear the list.
    baking_waits
        Whether baking is postponed, because its processes would take the cores from something more urgent. The caller
        sets this; once it is False, `poll` begins baking.
    """

    def __init__(self, assets: tuple[Asset, ...], processes: int | None = None) -> None:
        """Create a library of a scene's assets; nothing is read, and no process started, before it is needed.

        Parameters
        ----------
        assets
            The assets, by number.
        processes
            Number of processes that bake; None: as many as there are cores. Each imports the program's main module. 0
            bakes in a thread, for programs that would run again when they are imported.
        """
        super().__init__(assets, processes=processes)
        self.failures: list[str] = []
        self._ready: dict[_Request, Objects] = {}
        self._finding: dict[_Request, Future[Objects | None]] = {}
        self._unbaked: list[_Request] = []  # waiting to be baked
        self._making: dict[_Request, Future[str | None]] = {}
        self.baking_waits = False
        self._failed: set[_Request] = set()
        self._finder: ThreadPoolExecutor | None = None
        self._pool = BakePool()
        self._pools_broken = 0
        self._held: list[HeldArrays] = []
        self._is_mesh_read = False  # whether a mesh has been or is being read
        self._reading: defaultdict[int, threading.Lock] = defaultdict(threading.Lock)  # for its mesh, by asset
        self._batch = Batch()

    def sibling(self, assets: tuple[Asset, ...]) -> "BackgroundLibrary":
        """Return a library of other `assets`, which bakes as many at a time as this one."""
        return BackgroundLibrary(assets, processes=self._processes)

    # Before drawing begins --------------------------------------------------------------------------------------------

    def prefetch(self, scene: Scene, forced: Representation | None) -> None:
        """Begin to read what the first picture will show: headers, then geometry and texture, the nearest first.

        Failures are not reported here: they occur again when the asset is requested.

        Parameters
        ----------
        scene
            The scene, whose assets these are.
        forced
            The representation of all objects whose asset has it; None: each object's own.
        """
        camera, options = scene.camera, cook_options(scene.render)
        of_mesh = np.isin(requested_representations(scene.objects, self, forced), OF_MESH)
        imaged = set(scene.objects.asset[~of_mesh].tolist())
        for asset in nearest_first(scene.objects, None if camera is None else np.array(camera.position)):
            if asset in imaged:
                self.is_cooked(asset, options)
            elif self.has_mesh(asset):
                self._read_ahead(self._threads, self.mesh, asset)

    def mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset`; None if it has none. Waits if a thread is reading it."""
        if asset in self._meshes:
            return super().mesh(asset)
        with self._reading[asset]:
            return super().mesh(asset)

    def preview(self, asset: int) -> Mesh | None:
        """Return a coarse mesh as `MeshLibrary.preview` does. Waits if a thread is reading it."""
        with self._reading[asset]:
            return super().preview(asset)

    # What drawing asks for -------------------------------------------------------------------------------------------

    def is_cooked(self, asset: int, options: CookOptions) -> bool:
        """Return whether the cooked depth images of an asset are ready; if not, begin preparing the asset.

        Assets are prepared in the order in which they are first requested.

        Parameters
        ----------
        asset
            The number of the asset.
        options
            How it is cooked.

        Returns
        -------
        bool
            True if `cooked` returns at once.
        """
        request = asset, options
        if request in self._ready:
            return True
        known = request in self._finding or request in self._unbaked or request in self._making
        if not known and request not in self._failed:
            threads = self._threads
            self._finding[request] = threads.submit(self._find, asset, options, threads)
        return False

    def cooked(self, asset: int, options: CookOptions, *, again: bool = False) -> Objects:
        """Return the cooked depth images of an asset, one object for each part.

        The call waits if `is_cooked` is False.

        Parameters
        ----------
        asset
            The number of the asset.
        options
            How it is cooked.
        again
            Whether to cook even if the library or the cache has them, because what they have cannot be loaded.

        Raises
        ------
        InputError
            For files that cannot be used.
        LookupError
            If the asset has no depth images.
        """
        if again or (asset, options) not in self._ready:
            self._ready[asset, options] = super().cooked(asset, options, again=again)
        return self._ready[asset, options]

    def poll(self) -> bool:
        """Take over what has been found or made since the last call; return True if any asset became ready."""
        before = len(self._ready)
        for request in [request for request, future in self._finding.items() if future.done()]:
            self._finish_search(request, self._finding.pop(request))
        for asset, stage in self._pool.reports():
            self._batch.note(asset, stage)
        if not self.baking_waits:
            for request in self._unbaked:
                self._submit(request)
            self._unbaked.clear()
        for request in [request for request, future in self._making.items() if future.done()]:
            self._finish_bake(request, self._making.pop(request))
        if not self._making and not self._finding and not self._unbaked:
            self._batch = Batch()
        return len(self._ready) > before

    @property
    def is_searching(self) -> bool:
        """Return whether the cache is still being searched for a requested asset."""
        return bool(self._finding)

    @property
    def is_busy(self) -> bool:
        """Return whether any requested asset is still being searched, baked or cooked."""
        return bool(self._finding or self._unbaked or self._making)

    @property
    def progress(self) -> Progress | None:
        """Return the progress of baking and cooking; None if nothing is being baked or cooked."""
        return self._batch.progress(self._assets) if self._making else None

    def cancel(self) -> None:
        """Stop baking and cooking. Assets that are not ready stay so, and are not prepared again."""
        self._failed.update(self._finding.keys() | self._making.keys(), self._unbaked)
        for future in self._finding.values():
            future.cancel()
        self._finding.clear()
        self._unbaked.clear()
        self._making.clear()
        self._pool.end()
        self._batch = Batch()

    def close(self) -> None:
        """Stop all work, and remove the files that were written outside the cache."""
        self.cancel()
        if self._finder is not None:
            self._finder.shutdown(wait=False, cancel_futures=True)
            self._finder = self._ahead = None
        self._pool.close()

    # What the thread does --------------------------------------------------------------------------------------------

    @property
    def _threads(self) -> ThreadPoolExecutor:
        if self._finder is None:
            self._finder = ThreadPoolExecutor(1, "depth-images")
            self._ahead = Prefetcher(self._finder)
        return self._finder

    def _find(self, asset: int, options: CookOptions, threads: Executor) -> Objects | None:
        """Return an asset's objects from the cache, or from its own file; None if it must be baked or cooked.

        Assets that no cache may store are cooked here, since another process could not hand over the result. The arrays
        of found objects are then read by `threads`, since the first picture needs most of them. For the first missing
        one, its mesh is read, and the process that will bake it imports what it needs.
        """
        if self.is_shipped_cooked(asset):
            return super().cooked(asset, options)
        key = self.key(asset)
        if not key:
            return super().cooked(asset, options)
        found = find_cooked(key, options)
        if found is not None:
            return self._prefetched(found)
        self._pool.begin(self._processes)
        # Of a large file that process reads the whole mesh, and this one only what is shown meanwhile.
        self._read_ahead(threads, self.preview if self.has_preview(asset) else self.mesh, asset)
        return None

    def _read_ahead(self, threads: Executor, read: Callable[[int], Mesh | None], asset: int) -> None:
        """Have `threads` `read` the mesh of an asset, unless another has been; callers that need it wait."""
        if not self._is_mesh_read:
            self._is_mesh_read = True
            threads.submit(read, asset)

    def _load_made(self, asset: int, options: CookOptions, spilled: str | None) -> Objects:
        """Return objects made by another process, with arrays loaded so that they can replace the mesh at once."""
        self._keys.pop(asset, None)  # the file may have been replaced since its key was computed
        objects = read_cooked(Path(spilled)) if spilled else find_cooked(self.key(asset), options)
        if objects is None:
            raise InputError(f"{self._assets[asset].name}: its depth images are no longer in the cache")
        try:
            return tuple(replace(cooked, load=HeldArrays(cooked.load)) for cooked in objects)
        except OSError as error:
            raise InputError(
                f"{self._assets[asset].name}: its depth images are no longer in the cache: {error}"
            ) from None

    def _finish_search(self, request: _Request, future: "Future[Objects | None]") -> None:
        try:
            objects = future.result()
        except InputError as error:
            self._fail(request, str(error))
            return
        if objects is not None:
            self._ready[request] = objects
            self._hold(objects)
            return
        self._batch.total += 1
        self._unbaked.append(request)

    def _hold(self, objects: Objects) -> None:
        """Remember preloaded objects; if there are too many, drop the arrays of the oldest until they are needed."""
        self._held += [cooked.load for cooked in objects if isinstance(cooked.load, HeldArrays)]
        self._held = [load for load in self._held if load.is_held]
        while len(self._held) > _MOST_HELD:
            self._held.pop(0).drop()

    # What other processes do -----------------------------------------------------------------------------------------

    def _submit(self, request: _Request) -> None:
        asset, options = request
        self._pool.begin(self._processes)
        self._making[request] = self._pool.submit(asset, self._assets[asset], options, self._meshes.get(asset))

    def _finish_bake(self, request: _Request, future: "Future[str | None]") -> None:
        asset, options = request
        try:
            spilled = future.result()
        except UnbakableError as error:
            self._fail(request, f"{error.reason}; it is drawn as polygons")
        except InputError as error:
            self._fail(request, str(error))
        except BrokenExecutor:
            self._retry(request)
            return
        else:
            self._finding[request] = self._threads.submit(self._load_made, asset, options, spilled)
        self._batch.finish(asset)

    def _retry(self, request: _Request) -> None:
        """Begin again after a process was killed, say for lack of memory: one asset at a time, and only once."""
        outstanding = [request, *self._making]
        self._making.clear()
        self._pool.end()
        self._pools_broken += 1
        if self._pools_broken > 1:
            for lost in outstanding:
                self._fail(
                    lost,
                    f"{self._assets[lost[0]].name}: a baking process was killed again; its mesh is drawn",
                )
            return
        log.warning("a baking process was killed, perhaps for lack of memory; baking one asset at a time")
        self._processes = 1
        for lost in outstanding:
            self._submit(lost)

    def _fail(self, request: _Request, complaint: str) -> None:
        self._failed.add(request)
        self.failures.append(complaint)
        log.warning("%s", complaint)

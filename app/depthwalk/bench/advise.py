"""Find the quickest representation of each asset within an error limit, for `depthwalk advise`."""

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from depthwalk.assets.demand import cook_options
from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.mesh_library import Report
from depthwalk.bench.object_cost import COMPARED, Cost, ObjectCosts
from depthwalk.bench.tables.table import Cell, Table
from depthwalk.render import kernels
from depthwalk.render.lod.mesh_lod import is_simplified
from depthwalk.scene.arrays import Representation
from depthwalk.scene.scene import MeshAsset, Scene

SIZES = 300, 40, 120, 600, 15  # pixels, in the order in which they are measured while there is time
FRAMES = 8
# An error below the mesh's own, which is aliasing, cannot be demanded; up to a quarter more counts as equally good.
_AS_GOOD = 1.25
_CLEARLY = 0.9  # of the time of depth images: a mesh that takes longer is not worth switching to


@dataclass(frozen=True, kw_only=True)
class SizeAdvice:
    """Hold the measurements of an asset at one size.

    Attributes
    ----------
    asset
        Its name.
    pixels
        Height or width, whichever is larger, pixels.
    costs
        The cost of each representation that the asset has.
    quickest
        The quickest of those whose FLIP is low enough.
    mesh
        Whether `auto` draws the mesh: it is clearly quicker than depth images, or these are not good enough.
    """

    asset: str
    pixels: float
    costs: Mapping[Representation, Cost]
    quickest: Representation
    mesh: bool


@dataclass(frozen=True, kw_only=True)
class Advised:
    """Hold all measurements of a scene.

    Attributes
    ----------
    sizes
        The measurements, by asset and ascending size.
    left_out
        Why assets were not measured, by name.
    unfinished
        Number of measurements for which there was no time.
    """

    sizes: tuple[SizeAdvice, ...]
    left_out: Mapping[str, str]
    unfinished: int


def advise(
    scene: Scene,
    library: SceneLibrary,
    size: tuple[int, int],
    want_flip: float,
    seconds: float,
    report: Report,
) -> Advised:
    """Measure every asset that objects of a scene use and that has both a mesh and depth images made from it.

    Parameters
    ----------
    scene
        The scene.
    library
        Its assets.
    size
        Width and height of the pictures, pixels. Objects that are larger are not measured.
    want_flip
        The mean FLIP, where an object is, that is low enough, 0 to 1.
    seconds
        Time after which no further measurement begins. Baking missing depth images does not count.
    report
        Called with the name of an asset and the stage that begins.

    Returns
    -------
    Advised
        The results.

    Raises
    ------
    GpuError
        If no OpenGL 3.3 context can be created.
    InputError
        For assets that cannot be used.
    """
    kernels.load()
    left_out = dict(_left_out(scene, library))
    used = [asset for asset in _used(scene) if scene.assets[asset].name not in left_out]
    library.bake_missing(used)
    costs, drawn = {}, {}
    for asset in used:
        mesh = library.mesh(asset)
        assert mesh is not None  # the others are left out
        drawn[asset] = Representation.MESH_LOD if is_simplified(len(mesh.faces)) else Representation.MESH
        library.cooked(asset, cook_options(scene.render))
        library.mesh_levels(asset)
        library.mesh_clusters(asset)
        costs[asset] = ObjectCosts(scene, asset, library, size)
    start, found, unfinished = time.monotonic(), list[SizeAdvice](), 0
    for pixels in (pixels for pixels in SIZES if pixels <= max(size)):
        for asset in used:
            if time.monotonic() - start > seconds:
                unfinished += 1
                continue
            name = scene.assets[asset].name
            report(name, f"{pixels} pixels")
            measured = costs[asset].measured(pixels, FRAMES).by
            found.append(judged(name, pixels, measured, want_flip, drawn[asset]))
    found.sort(key=lambda advice: (advice.asset, advice.pixels))
    return Advised(sizes=tuple(found), left_out=left_out, unfinished=unfinished)


def judged(
    asset: str, pixels: float, costs: Mapping[Representation, Cost], want_flip: float, drawn: Representation
) -> SizeAdvice:
    """Return the advice for an asset at a size, given its cost by representation.

    A FLIP is low enough if it is at most `want_flip`, or at most a quarter above that of the mesh. `drawn` is the
    representation with which `auto` draws the mesh of the asset.
    """
    mesh, images = Representation.MESH, Representation.DPCI
    most = max(want_flip, _AS_GOOD * _flip(costs[mesh]))
    good = [kind for kind, cost in costs.items() if _flip(cost) <= most]
    return SizeAdvice(
        asset=asset,
        pixels=pixels,
        costs=costs,
        quickest=min(good, key=lambda kind: costs[kind].milliseconds),
        mesh=images not in good
        or (drawn in good and costs[drawn].milliseconds < _CLEARLY * costs[images].milliseconds),
    )


def _flip(cost: Cost) -> float:
    assert cost.flip is not None  # all are judged
    return cost.flip


def _used(scene: Scene) -> list[int]:
    return sorted(set(scene.objects.asset.tolist()))


def _left_out(scene: Scene, library: SceneLibrary) -> Iterable[tuple[str, str]]:
    """Yield the name of each asset for which there is no choice, and why."""
    for asset in _used(scene):
        spec = scene.assets[asset]
        if not library.has_mesh(asset):
            yield spec.name, "has no mesh"
        elif not library.has_baked(asset):
            yield spec.name, "has no depth images"
        elif isinstance(spec, MeshAsset) and spec.dpci is not None and spec.dpci.meso is not None:
            yield spec.name, "has a relief that its mesh lacks"


def fields(sizes: Sequence[SizeAdvice]) -> dict[str, list[dict[str, Any]]]:
    """Return, by asset, the fields of `scene.advice.SizeParams` of each size."""
    assets: dict[str, list[dict[str, Any]]] = {}
    for advice in sizes:
        measured = {
            kind.label: {"ms": round(cost.milliseconds, 4), "flip": round(_flip(cost), 5)}
            for kind, cost in advice.costs.items()
        }
        assets.setdefault(advice.asset, []).append(
            {
                "pixels": float(advice.pixels),
                "mesh": advice.mesh,
                "quickest": advice.quickest.label,
                "measured": measured,
            }
        )
    return assets


def to_table(advised: Advised, want_flip: float) -> Table:
    """Return the results as a table."""
    rows: list[tuple[Cell, ...]] = []
    for advice in advised.sizes:
        measured = (f"{cost.milliseconds:.2f} ({_flip(cost):.3f})" for cost in advice.costs.values())
        draws = Representation.MESH if advice.mesh else Representation.DPCI
        rows.append((advice.asset, f"{advice.pixels:g}", *measured, advice.quickest.label, draws.label))
    notes = [f"{name} {why}, so there is nothing to choose." for name, why in advised.left_out.items()]
    if advised.unfinished:
        notes.append(f"Not measured for lack of time: {advised.unfinished}; a larger --seconds allows more.")
    return Table(
        name="advise",
        title="Milliseconds per copy of an object, with its FLIP in brackets",
        source=f"Quickest: among those whose FLIP is at most {want_flip:g}, or at most a quarter above the mesh's",
        columns=("asset", "pixels", *(kind.label for kind in COMPARED), "quickest", "auto"),
        rows=tuple(rows),
        notes=tuple(notes),
    )

"""Convert the scene of a glTF or USD file to a folder with a scene file and a mesh file for each of its models."""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.conversion.environment import camera_values, environment_values, sky_values
from depthwalk.conversion.keyframes import Tracks
from depthwalk.conversion.models import HEAVY, Division, Model, divide
from depthwalk.errors import InputError, counted, missing_file
from depthwalk.files import check_folder, staging_folder
from depthwalk.ingest.formats import GLTF_SUFFIXES, USD_SUFFIXES
from depthwalk.ingest.gltf import read_header
from depthwalk.ingest.gltf_points import holds_points, undrawn_beside
from depthwalk.ingest.gltf_scene import GltfScene, damaged, read_gltf_scene
from depthwalk.ingest.gltf_subset import SubsetWriter, file_name
from depthwalk.ingest.loader import MeshExtent, measure_mesh
from depthwalk.ingest.sources import Sources, find
from depthwalk.limits import MAX_COORDINATE, MAX_INSTANCES, MAX_KEYFRAMES, MAX_MESH_TRIANGLES
from depthwalk.scene.loader import load_scene
from depthwalk.scene.similarity import angles
from depthwalk.scene.yaml_text import block_lines, double_quoted, flow_text

_LISTED = 20  # copies of a model that the scene file lists, with their names; more are in a file of places
_APART, _APART_OF_SCENE = 1e-3, 1 / 2000  # m, and part of the scene: how far beside its movement an object may be
_ENCLOSED = 0.5  # part of the other objects that an object encloses which is their surroundings

Report = Callable[[str, str], None]  # called with a model's name and the step that begins


@dataclass(frozen=True, kw_only=True)
class Conversion:
    """Hold what a conversion has made.

    Attributes
    ----------
    scene
        The scene file.
    models, objects
        How many models and objects it has.
    triangles
        Of the meshes of all objects.
    notes
        What is not as in the file, a text each.
    """

    scene: Path
    models: int
    objects: int
    triangles: int
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class _Asset:
    """Hold a model whose mesh file is written.

    name: of the asset. extent: of its file. base (3,): where in its file objects have their origin. position (n, 3):
    where its copies stand.
    """

    name: str
    model: Model
    extent: MeshExtent
    base: NDArray[np.float64]
    position: NDArray[np.float64]


def convert_gltf(path: Path, folder: Path, report: Report = lambda name, step: None) -> Conversion:
    """Convert the default scene of a glTF, GLB or USD file.

    Parameters
    ----------
    path
        The file.
    folder
        The folder to make, which must be empty or not exist yet. It appears when it is complete.
    report
        Is called with the name of each model before it is written and measured.

    Returns
    -------
    Conversion
        What was made.

    Raises
    ------
    InputError
        `path: defect`, for a file that cannot be read or shows nothing, or about a `folder` with files in it.
    OSError
        If a file cannot be written.
    """
    if path.suffix.lower() not in GLTF_SUFFIXES:
        raise InputError(f"{path}: only glTF, GLB and USD files hold scenes that can be converted")
    if not path.is_file():
        raise missing_file(path)
    check_new(folder)
    sources = Sources()
    scene = read_gltf_scene(path, sources)
    with damaged(path):
        divided = divide(scene.models)
    written = read_header(sources.read(path), path)  # as it is in the file, without posed copies of meshes
    _check(path, divided, written)
    with _about(path), staging_folder(folder.parent) as staging:
        made = Path(staging) / folder.name
        made.mkdir()
        with damaged(path):
            models = [*divided.own, *divided.surroundings]
            assets = list(_write_models(path, scene, models, made, _external(path, sources), report))
            values, notes = _values(path, scene, assets, made, divided.stopped)
        file = made / f"{file_name(path.stem, 'scene')}.yaml"
        file.write_text("\n".join([f"# Made from {double_quoted(path.name)}", *_scene_lines(values)]) + "\n", "utf-8")
        load_scene(file)
        _replace(made, folder)
    if merged := divided.merged:
        why = "stretched, sheared or mirrored otherwise than the rest"
        notes.append(f"{counted(merged, 'object')} merged with the surroundings: {why}")
    if flat := divided.flat:
        notes.append(f"{counted(flat, 'node')} left out: scaled to nothing")
    if undrawn := undrawn_beside(written):
        notes.append(f"{' and '.join(undrawn)} left out: only triangles are converted")
    return Conversion(
        scene=folder / file.name,
        models=len(assets),
        objects=sum(len(asset.position) for asset in assets),
        triangles=sum(len(asset.position) * asset.model.triangles for asset in assets),
        notes=tuple(notes),
    )


@contextmanager
def _about(path: Path) -> Iterator[None]:
    """Name the file `path` in InputErrors of a `with` block, which are about the files made of it."""
    try:
        yield
    except InputError as error:
        raise error.at(f"{path}") from error


def check_new(folder: Path) -> None:
    """Raise InputError unless the `folder` is empty or does not exist, and can be made."""
    if folder.is_dir() and any(folder.iterdir()):
        raise InputError(f"{folder}: is not empty; name another folder with -o")
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; name another folder with -o")
    check_folder(folder, may_be_folder=True)


def _replace(made: Path, folder: Path) -> None:
    """Move the finished folder to its place."""
    if folder.is_dir():
        folder.rmdir()  # it is empty, or it has got files meanwhile and this fails
    os.rename(made, folder)


def _check(path: Path, divided: Division, header: dict[str, Any]) -> None:
    """Raise InputError if there is nothing to show, or more than a scene holds. header: that of the file."""
    models = [*divided.own, *divided.surroundings]
    if not models:
        remedy = "; a scan of points needs no conversion: `depthwalk view` shows it" if holds_points(header) else ""
        raise InputError(f"{path}: its scene shows no triangles{remedy}")
    if (count := sum(len(model.scale) for model in models)) > MAX_INSTANCES:
        raise InputError(f"{path}: {count} objects, the limit is {MAX_INSTANCES}")
    if (triangles := sum(model.triangles for model in divided.surroundings)) > MAX_MESH_TRIANGLES:
        raise InputError(f"{path}: {triangles} triangles of models beyond the most that a scene can have")


def _external(path: Path, sources: Sources) -> Callable[[str], bytes | None]:
    """Return a function that returns the contents of the file that a URI in `path` names; None without one."""

    def read(uri: str) -> bytes | None:
        file = find(uri, [path.parent], sources)
        return None if file is None else sources.read(file)

    return read


def _write_models(
    path: Path,
    scene: GltfScene,
    models: Iterable[Model],
    folder: Path,
    external: Callable[[str], bytes | None],
    report: Report,
) -> Iterable[_Asset]:
    """Write a mesh file for each model into a folder, and yield them as assets with names of their own."""
    writer = SubsetWriter(path, scene.header, scene.accessors, folder, external)
    taken: set[str] = set()
    for model in models:
        name = _unused(file_name(model.name, "model"), taken)
        report(name, "writing")
        file = folder / f"{name}.glb"
        writer.write(file, model.meshes, model.matrices)
        report(name, "measuring")
        extent = measure_mesh(file)
        middle = (extent.low + extent.high) / 2
        base = np.array([middle[0], extent.low[1], middle[2]])  # where `load_mesh` puts the origin
        moved = np.einsum("nij,j->ni", model.rotation, base) * model.scale[:, None]
        yield _Asset(name=name, model=model, extent=extent, base=base, position=model.position + moved)


def _unused(name: str, taken: set[str]) -> str:
    """Return a name like `name` that is not taken, also where upper and lower case are the same, and take it."""
    found, number = name, 1
    while found.lower() in taken:
        number += 1
        found = f"{name}-{number}"
    taken.add(found.lower())
    return found


def _values(
    path: Path, scene: GltfScene, assets: list[_Asset], folder: Path, stopped: int
) -> tuple[dict[str, Any], list[str]]:
    """Return the values of the scene file, whose files of places are written, and notes about it."""
    every = np.concatenate([asset.position for asset in assets])
    if (far := np.abs(every).max()) > MAX_COORDINATE:
        raise InputError(f"{path}: an object is {far:g} m from the origin, the limit is {MAX_COORDINATE:g} m")
    sky, without_sky = None, list[str]()
    if path.suffix.lower() in USD_SUFFIXES:
        sky, without_sky = sky_values(scene.header, scene.accessors, folder)
    environment, notes = environment_values(scene.lights, sky)
    notes += without_sky
    values: dict[str, Any] = {"version": 1, "assets": {}, "objects": [], "environment": environment}
    if scene.cameras:
        values["camera"] = camera_values(scene.cameras[0])
    tracks = Tracks(_tolerance(assets, every))
    viewers = np.array([camera.position for camera in scene.cameras]).reshape(-1, 3)
    for asset in assets:
        encloses = len(asset.position) == 1 and _encloses(asset, every, viewers)
        heavy = asset.model.triangles >= HEAVY
        values["assets"][asset.name] = {"mesh": f"{asset.name}.glb"}
        if heavy and not encloses and asset.extent.is_bakeable:
            values["assets"][asset.name]["dpci"] = {}
        drawn = {"representation": "mesh-clusters"} if heavy and encloses else {}
        values["objects"] += _still_objects(asset, drawn, folder) + _moving_objects(asset, drawn, tracks)
    return values, [*notes, *scene.notes, *_movement_notes(tracks, stopped + scene.stopped)]


def _tolerance(assets: list[_Asset], every: NDArray[np.float64]) -> float:
    """Return how far beside its movement an object may be, metres, for those of a scene at `every` position (n, 3)."""
    largest = max(
        float(np.linalg.norm(asset.extent.high - asset.extent.low) * asset.model.scale.max()) for asset in assets
    )
    return max(min(_APART, max(largest, float(np.ptp(every, axis=0).max())) * _APART_OF_SCENE), 1e-9)


def _movement_notes(tracks: Tracks, others: int) -> Iterator[str]:
    """Yield what is not as in the file, of what moves; `others` stand still besides those of the tracks."""
    if stopped := tracks.stopped + others:
        kept = f"a scene file holds {MAX_KEYFRAMES:,} keyframes, and 200 turns of each"
        yield f"{counted(stopped, 'object')} that should move {'stands' if stopped == 1 else 'stand'} still; {kept}"
    if tracks.reshaped:
        moves = "moves without its" if tracks.reshaped == 1 else "move without their"
        yield f"{counted(tracks.reshaped, 'object')} {moves} change of shape: objects change their size alone"


def _encloses(asset: _Asset, every: NDArray[np.float64], viewers: NDArray[np.float64]) -> bool:
    """Return whether a single object holds a viewer or most other objects, as a room or a terrain does.

    Depth images show an object from outside; of this one the mesh would be drawn in any case.
    """
    low, high = asset.extent.low, asset.extent.high
    place, turn, scale = asset.model.position[0], asset.model.rotation[0], asset.model.scale[0]

    def inside(points: NDArray[np.float64]) -> int:
        local = (points - place) @ turn / scale
        return int(np.count_nonzero(((local >= low) & (local <= high)).all(axis=1)))

    others = len(every) - 1
    return bool(inside(viewers) or (others and inside(every) - 1 > _ENCLOSED * others))


def _moving_objects(asset: _Asset, drawn: dict[str, str], tracks: Tracks) -> list[dict[str, Any]]:
    """Return the entries of `objects` for the copies of a model that move."""
    return [
        ({"name": name[:100]} if name else {})
        | {"asset": asset.name}
        | drawn
        | tracks.values(tracks.track(movement, asset.base))
        for name, movement in zip(asset.model.names, asset.model.movements, strict=True)
        if movement is not None
    ]


def _still_objects(asset: _Asset, drawn: dict[str, str], folder: Path) -> list[dict[str, Any]]:
    """Return the entries of `objects` for the copies that stand still; if these are many, their file is written."""
    still = ~asset.model.moves
    if not still.any():
        return []
    model, position = asset.model.some(still), asset.position[still]
    yaw, pitch, roll = (np.degrees(angle) for angle in angles(model.rotation))
    if len(model.scale) > _LISTED:
        (folder / "places").mkdir(exist_ok=True)
        columns = np.column_stack([position, yaw, model.scale, pitch, roll])
        used = 7 if np.abs(columns[:, 5:]).max() > 1e-4 else 5
        np.save(folder / "places" / f"{asset.name}.npy", columns[:, :used])
        return [{"places": {"asset": asset.name, "file": f"places/{asset.name}.npy"} | drawn}]
    objects = []
    for row, name in enumerate(model.names):
        turned = {"yaw": yaw[row], "pitch": pitch[row], "roll": roll[row]}
        values: dict[str, Any] = {"name": name[:100]} if name else {}
        values |= {"asset": asset.name, "position": [round(float(at), 6) + 0.0 for at in position[row]]}
        values |= {key: round(float(angle), 6) for key, angle in turned.items() if abs(angle) > 1e-5}
        if abs(model.scale[row] - 1) > 1e-6:
            values["scale"] = float(f"{model.scale[row]:.7g}")
        objects.append(values | drawn)
    return objects


def _object_lines(values: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of an object: one, or one more for each of its keyframes."""
    if "animation" not in values:
        yield f"  - {flow_text(values)}"
        return
    own = {key: value for key, value in values.items() if key != "animation"}
    yield f"  - {flow_text(own)[:-1]}, animation: {{interpolation: {values['animation']['interpolation']}, keyframes: ["
    keyframes = [f"      {flow_text(keyframe)}" for keyframe in values["animation"]["keyframes"]]
    yield from (f"{line}," for line in keyframes[:-1])
    yield f"{keyframes[-1]}]}}}}"


def _scene_lines(values: dict[str, Any]) -> list[str]:
    """Return the lines of the scene file, an object in each, with its keyframes below it."""
    lines = []
    for key, value in values.items():
        if key == "objects":
            lines += ["objects:", *(line for item in value for line in _object_lines(item))]
        elif key == "environment" and "lights" in value:
            lamps = [f"    - {flow_text(lamp)}" for lamp in value["lights"]]
            others = {name: child for name, child in value.items() if name != "lights"}
            lines += ["environment:", *block_lines(others, "  "), "  lights:", *lamps]
        else:
            lines += block_lines({key: value})
    return lines

"""Read what the scene of a glTF file shows: its models, where they stand, its cameras and lamps.

`read_soup` makes one mesh of all that. Here copies stay copies, and what moves keeps its movement.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError, reason
from depthwalk.ingest import gltf
from depthwalk.ingest.formats import USD_SUFFIXES
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_animations import Movement, read_animation
from depthwalk.ingest.gltf_channels import FARTHEST
from depthwalk.ingest.gltf_compression import decompress
from depthwalk.ingest.gltf_copies import first_of_same
from depthwalk.ingest.gltf_lights import LIGHTS, PlacedCamera, PlacedLight, cameras, lights
from depthwalk.ingest.gltf_models import Models, PlacedModel, index_of
from depthwalk.ingest.gltf_pose import is_posed, pose, posed_size, top_nodes, world_matrices
from depthwalk.ingest.gltf_sizes import read_buffer
from depthwalk.ingest.soup import check_mesh_memory
from depthwalk.ingest.sources import Sources

Header = dict[str, Any]
_Matrices = NDArray[np.float64]  # (…, 4, 4)


@dataclass(frozen=True, kw_only=True)
class GltfScene:
    """Hold the scene of a glTF file.

    Attributes
    ----------
    header
        The JSON header, in which skinned and morphed meshes are replaced by those of their pose.
    accessors
        Reads the header's accessors.
    models, cameras, lights
        What the scene shows, in the order of the file.
    notes
        What of the file's movement is not in the models, a text each.
    stopped
        How many placements of the models stand still though their nodes move: more than a scene has keyframes for.
    """

    header: Header
    accessors: Accessors
    models: tuple[PlacedModel, ...]
    cameras: tuple[PlacedCamera, ...]
    lights: tuple[PlacedLight, ...]
    notes: tuple[str, ...]
    stopped: int


def read_gltf_scene(path: Path, sources: Sources) -> GltfScene:
    """Read the default scene of a glTF or GLB file; of a file without scenes, all of its nodes.

    Only the header is read, and where meshes are posed or instanced, what this takes. Meshes stay in the file until
    `gltf_subset` writes them to others. Instances of `EXT_mesh_gpu_instancing` are placements like others.

    Parameters
    ----------
    path
        The file.
    sources
        Reads files and keeps their bytes.

    Returns
    -------
    GltfScene
        The scene.

    Raises
    ------
    InputError
        `path: defect`.
    """
    data = sources.read(path)
    header = gltf.read_header(data, path)
    with damaged(path):
        gltf.check_header(header, path, known=gltf.INSTANCING)
        accessors = Accessors(header, data, lambda uri: read_buffer(uri, path, sources))
        decompress(header, accessors, path)
        if is_posed(header):
            check_mesh_memory(*posed_size(header), path)
        return _read(header, accessors, len(data))


@contextmanager
def damaged(path: Path) -> Iterator[None]:
    """Report wrong types and values in the header of the file `path`, met in a `with` block, as an InputError."""
    try:
        yield
    except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError) as error:
        kind = "USD" if path.suffix.lower() in USD_SUFFIXES else "glTF"
        raise InputError(f"{path}: damaged, truncated or an unsupported kind of {kind} ({reason(error)})") from error


def _read(header: Header, accessors: Accessors, length: int) -> GltfScene:
    """Return the scene of a checked header, in a file of so many bytes.

    Raises ValueError, TypeError or LookupError for damaged data.
    """
    nodes = header.setdefault("nodes", [])
    if not header.get("scenes"):
        header["scenes"] = [{"nodes": top_nodes(nodes)}]
        header["scene"] = 0
    skins = any("skin" in node for node in nodes)
    if is_posed(header):
        pose(header, accessors)
    animation = read_animation(header, accessors)
    first = first_of_same(header, accessors, length + sum(map(_length, header.get("buffers", []))))
    for node in nodes:
        if "mesh" in node:
            node["mesh"] = first[index_of(node["mesh"], first)]
    roots = header["scenes"][header.get("scene", 0)].get("nodes", [])
    world = world_matrices(nodes, roots)
    _check_forest(nodes, roots, world)
    movements = animation.movements(nodes, world)
    models = Models(header, accessors, world, movements)
    placed = tuple(models.found(roots))
    return GltfScene(
        header=header,
        accessors=accessors,
        models=placed,
        cameras=tuple(cameras(header, world)),
        lights=tuple(lights(header, world)),
        notes=(*animation.notes, *_still(header, movements, skins)),
        stopped=models.stopped,
    )


def _still(header: Header, movements: Mapping[int, Movement], skins: bool) -> Iterator[str]:
    """Yield notes about what stands still though nodes move: skinned meshes, cameras and lights."""
    if skins and movements and header.get("skins"):
        joints = {joint for skin in header["skins"] for joint in skin["joints"]}
        if joints & movements.keys():
            yield "skinned meshes keep the pose that the file has them in"
    moving = [header["nodes"][number] for number in movements]
    if any("camera" in node for node in moving):
        yield "cameras stand still"
    if any("light" in gltf.object_under(gltf.object_under(node, "extensions"), LIGHTS) for node in moving):
        yield "lights stand still"


def _length(buffer: Header) -> int:
    """Return how many bytes a buffer has that is a file of its own."""
    return int(buffer["byteLength"]) if "uri" in buffer else 0


def _check_forest(nodes: list[Header], roots: list[int], world: dict[int, _Matrices]) -> None:
    """Raise ValueError if nodes of the scene hang from several parents, or their matrices have too large numbers."""
    parents = Counter(child for number in world for child in nodes[number].get("children", [])) + Counter(roots)
    if twice := [number for number, count in parents.items() if count > 1]:
        raise ValueError(f"node {twice[0]} hangs from {parents[twice[0]]} nodes")
    for number, matrix in world.items():
        if not (np.abs(matrix) < FARTHEST).all():
            raise ValueError(f"node {number} is out of reach")

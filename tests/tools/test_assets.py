"""The files in assets/ against their own list, their budget and the claims of the catalogue."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from tools.make_models.catalogue import MODELS, TEXTURES
from trimesh.visual import ColorVisuals

ASSETS = Path(__file__).resolve().parents[2] / "assets"
BUDGET = 10 * 1000 * 1000  # bytes, meshes and textures together


@cache
def loaded(name: str) -> trimesh.Trimesh:
    return trimesh.load_mesh(ASSETS / f"{name}.ply", process=False)


def listed() -> dict[str, tuple[int, list[float]]]:
    """Triangles and size by file name, as SOURCES.md says."""
    rows = re.findall(r"^\| (\w+\.ply) \| (\d+) \| ([\d.× ]+) \|", (ASSETS / "SOURCES.md").read_text("utf-8"), re.M)
    return {name: (int(count), [float(v) for v in size.split("×")]) for name, count, size in rows}


def test_sources_list_every_file() -> None:
    made = {f"{n}.ply" for n in MODELS} | {f"{n}.png" for n in TEXTURES}
    text = (ASSETS / "SOURCES.md").read_text("utf-8")
    assert listed().keys() == {f"{n}.ply" for n in MODELS}
    assert all(f"| {name} |" in text and (ASSETS / name).is_file() for name in made)


def test_budget() -> None:
    files = [ASSETS / f"{n}.ply" for n in MODELS] + [ASSETS / f"{n}.png" for n in TEXTURES]
    assert sum(f.stat().st_size for f in files) <= BUDGET


@pytest.mark.parametrize(("name", "count"), [("head_venus", 67_170), ("head_man", 78_157)])
def test_heads_have_the_papers_counts(name: str, count: int) -> None:
    assert len(loaded(name).faces) == count


@pytest.mark.parametrize("name", MODELS)
def test_mesh_is_sound(name: str) -> None:
    mesh = loaded(name)
    count, size = listed()[f"{name}.ply"]
    assert len(mesh.faces) == count
    np.testing.assert_allclose(mesh.extents, size, atol=0.0051)
    assert np.isfinite(mesh.vertices).all()
    assert mesh.area_faces.min() > 0
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))
    assert mesh.bounds[0, 1] == pytest.approx(0, abs=1e-6)
    assert mesh.is_winding_consistent
    assert isinstance(mesh.visual, ColorVisuals)
    assert mesh.visual.vertex_colors[:, :3].std(axis=0).max() > 3


@pytest.mark.parametrize("name", [n for n, entry in MODELS.items() if entry.closed])
def test_closed_models_are_watertight_and_look_outward(name: str) -> None:
    assert loaded(name).is_watertight
    assert loaded(name).volume > 0


def test_the_mans_head_lacks_one_face_only() -> None:
    edges = np.sort(loaded("head_man").edges, axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses == 1).sum() == 3
    assert (uses > 2).sum() == 0


@pytest.mark.parametrize("name", [n for n in MODELS if n != "room"])
def test_first_hits_from_outside_face_the_ray(name: str) -> None:
    mesh = loaded(name)
    low, high = mesh.bounds
    rng = np.random.default_rng(1)
    origins = np.column_stack(
        [rng.uniform(low[0], high[0], 200), rng.uniform(low[1], high[1], 200), np.full(200, high[2] + 1)]
    )
    hit = mesh.ray.intersects_first(origins, np.broadcast_to([0.0, 0, -1], (200, 3)))
    normals = mesh.face_normals[hit[hit >= 0]]
    assert len(normals) > 20
    assert (normals[:, 2] > -1e-6).all()


def test_the_room_looks_inward() -> None:
    mesh = loaded("room")
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    hit = mesh.ray.intersects_first(np.tile([0.5, 0.5, 0.3], (6, 1)), directions)
    assert (np.einsum("ij,ij->i", mesh.face_normals[hit], directions) < -0.99).all()


def test_the_rooms_floor_ends_at_its_walls_only() -> None:
    mesh = loaded("room")
    floor = mesh.faces[(mesh.vertices[mesh.faces][..., 1] == 0).all(1) & (mesh.face_normals[:, 1] > 0.99)]
    place, vertex = np.unique(mesh.vertices, axis=0, return_inverse=True)
    edges = np.sort(vertex.reshape(-1)[floor[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)], axis=1)
    edge, uses = np.unique(edges, axis=0, return_counts=True)
    ends = np.abs(place[edge[uses == 1]][..., [0, 2]]) == 3
    assert len(floor) == 1920 and ends.all(1).any(1).all()

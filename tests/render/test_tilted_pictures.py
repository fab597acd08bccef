"""Objects that lean, lie and stand upside down look as if their models had been made so."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import depthwalk as dw
import shapes
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.scene.arrays import Representation
from depthwalk.scene.schema import RepresentationName
from depthwalk.scene.similarity import from_angles
from files import write_ply
from studio import Studio

pytestmark = [pytest.mark.gl, pytest.mark.usefixtures("gl_device")]
SIZE = (160, 120)
SCENE = """
version: 1
assets:
  made: {{mesh: made.ply, dpci: {{resolution: 128, layers: 2}}}}
  turned: {{mesh: turned.ply}}
objects:
  - {object}
environment: {{ground: {{height: -1.5}}, sun: {{direction: [-0.6, -1, -0.5]}}}}
render: {{lod: {{magnification: 0}}, shadows: {{enabled: true}}}}
"""
POSITION, SCALE = np.array([0.2, 0.4, -0.3]), 1.25
ANGLES = {"leaning": (30, 20, -25), "fallen": (-40, 90, 0), "on its side": (70, 0, 90), "upside down": (15, 0, 180)}
EYES = {"front": (0.5, 1.2, 6.5), "above": (1.0, 7.0, 1.0), "far": (-26.0, 5.0, -32.0)}


def hook() -> Mesh:
    """A post with an arm and a foot, different from each side, that stands on the origin."""
    return shapes.joined(
        shapes.box(0.4, 2.0, 0.4, (0.0, 1.0, 0.0)),
        shapes.box(1.0, 0.3, 0.3, (0.5, 1.6, 0.0)),
        shapes.box(0.5, 0.2, 1.0, (0.0, 0.1, 0.4)),
    )


def rotation_matrix(yaw: float, pitch: float, roll: float) -> NDArray[np.float64]:
    """The product of three matrices; degrees."""
    (cy, cx, cz), (sy, sx, sz) = np.cos(np.radians([yaw, pitch, roll])), np.sin(np.radians([yaw, pitch, roll]))
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_y @ about_x @ about_z)


def base(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """The centre of the base of the points' box, where the loader puts a model's origin."""
    low, high = points.min(0).astype(float), points.max(0).astype(float)
    return np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])


def scenes(folder: Path, angles: tuple[int, int, int], representation: RepresentationName) -> tuple[Path, Path]:
    """A scene that turns a model, and one with the model turned by matrices, which stands upright."""
    mesh, turn = hook(), rotation_matrix(*angles)
    points = SCALE * (mesh.positions - base(mesh.positions)) @ turn.T
    turned = replace(mesh, positions=points.astype(np.float32), normals=(mesh.normals @ turn.T).astype(np.float32))
    write_ply(folder / "made.ply", mesh)
    write_ply(folder / "turned.ply", turned)
    yaw, pitch, roll = angles
    as_placed = f"position: {POSITION.tolist()}, scale: {SCALE}, yaw: {yaw}, pitch: {pitch}, roll: {roll}"
    as_made = f"position: {(POSITION + base(points)).tolist()}"
    for name, thing in (
        ("placed", f"made, {as_placed}, representation: {representation}"),
        ("made", f"turned, {as_made}"),
    ):
        (folder / f"{name}.yaml").write_text(SCENE.format(object=f"{{asset: {thing}}}"))
    return folder / "placed.yaml", folder / "made.yaml"


def pictures(file: Path) -> list[dw.Image]:
    with dw.Renderer(dw.load_scene(file), SIZE) as renderer:
        target = (0.2, 0.4, -0.3)
        fov = {name: np.radians(5 if name == "far" else 45) for name in EYES}
        return [renderer.render(dw.Camera(eye, target, fov[name]), object_id=True) for name, eye in EYES.items()]


@pytest.mark.parametrize(
    "representation",
    ["mesh", "dpci", *(pytest.param(each, marks=pytest.mark.slow) for each in ("mesh-lod", "mesh-clusters", "dmesh"))],
)
@pytest.mark.parametrize("angles", ANGLES.values(), ids=list(ANGLES))
def test_a_turned_object_is_a_turned_model(
    tmp_path: Path, angles: tuple[int, int, int], representation: RepresentationName
) -> None:
    """In colours, with its shadow, and in depth, wherever it is seen from."""
    placed, made = scenes(tmp_path, angles, representation)
    exact = representation.startswith("mesh")
    for found, wanted in zip(pictures(placed), pictures(made), strict=True):
        assert found.object_id is not None and wanted.object_id is not None
        here, there = found.object_id == 0, wanted.object_id == 0
        assert there.sum() > 400
        assert (here ^ there).sum() <= (0.01 if exact else 0.04) * there.sum()
        off = np.abs(found.depth[here & there] - wanted.depth[here & there])
        distance = np.median(wanted.depth[there])
        assert np.quantile(off, 0.98) < (1e-3 if exact else 0.02), f"depths of {distance:.0f} m"
        difference = np.abs(found.rgba[..., :3].astype(int) - wanted.rgba[..., :3]).max(-1)
        assert (difference > 16).mean() < (0.002 if exact else 0.01)


ROLLED = """
version: 1
assets:
  whole: {{mesh: made.ply, dpci: {{resolution: 128, layers: 2}}}}
  flat: {{depth_image: {{depth: depth.png, size: [2.4, 1.6], range: 0.4}}}}
objects:
  - {{asset: {asset}, position: {position}, roll: {roll}, representation: {representation}}}
render: {{lod: {{magnification: 0}}}}
"""
OF_MESHES = ("mesh", "mesh-lod", "mesh-clusters", "dpci", "dmesh", "octahedral", "billboard")
OF_IMAGES = ("relief", "distance", "parallax", "bump", "displacement", "relief-texture", "bar-texture")


@pytest.mark.parametrize(
    ("asset", "representation"), [*(("whole", name) for name in OF_MESHES), *(("flat", name) for name in OF_IMAGES)]
)
def test_what_rolls_about_the_line_of_sight_rolls_in_the_picture(
    tmp_path: Path, asset: str, representation: RepresentationName
) -> None:
    """Whatever draws it, by a quarter turn counter-clockwise."""
    write_ply(tmp_path / "made.ply", hook())
    rows, columns = np.mgrid[0:48, 0:72]
    depth = 127 + 100 * np.sin(columns / 11) * np.cos(rows / 17)
    Image.fromarray(depth.astype(np.uint8)).save(tmp_path / "depth.png")
    camera = dw.Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0), np.radians(40))
    images = []
    for roll, position in ((0, [0.3, -0.7, 0.2]), (90, [0.7, 0.3, 0.2])):
        text = ROLLED.format(asset=asset, representation=representation, roll=roll, position=position)
        (tmp_path / "scene.yaml").write_text(text)
        with dw.Renderer(dw.load_scene(tmp_path / "scene.yaml"), (128, 128)) as renderer:
            images.append(renderer.render(camera, object_id=True))
    upright, rolled = images
    assert upright.object_id is not None and rolled.object_id is not None
    here, there = rolled.object_id == 0, np.rot90(upright.object_id) == 0
    assert there.sum() > 900
    assert (here ^ there).sum() <= 0.02 * there.sum()
    both = here & there
    assert np.quantile(np.abs(rolled.depth[both] - np.rot90(upright.depth)[both]), 0.98) < 0.01


@pytest.mark.parametrize("representation", [Representation.MESH, Representation.DPCI])
def test_glass_leans_with_its_object(studio: Studio, representation: Representation) -> None:
    """A pane in front of a wall, which depth images do not show."""
    mesh, angles = shapes.panes((0.0, Material()), (0.6, Material((0.2, 0.9, 0.3), opacity=0.5))), (25, -35, 50)
    turn = rotation_matrix(*angles)
    positions, normals = (array @ turn.T.astype(np.float32) for array in (mesh.positions, mesh.normals))
    scene = shapes.scene_of((0, (0.1, 0.2, 0.3), 0.0, 1.0), representation=representation)
    scene.objects.rotation[:] = from_angles(*np.radians(angles)[:, None])
    made = shapes.scene_of((0, (0.1, 0.2, 0.3), 0.0, 1.0), representation=Representation.MESH)
    camera = dw.Camera((0.5, 1.5, 6.0), (0.0, 0.8, 0.3), np.radians(45))
    found = studio.picture(scene, shapes.ShapeLibrary([mesh]), camera)
    wanted = studio.picture(made, shapes.ShapeLibrary([replace(mesh, positions=positions, normals=normals)]), camera)
    green = wanted[..., 1] > wanted[..., 0] + 0.1
    assert green.sum() > 1000
    assert (np.abs(found - wanted).max(-1) > 0.06).sum() < 0.02 * green.sum()

"""Pictures as arrays: colours, depth, and which object is where."""

import logging
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import depthwalk as dw
from balls import write_balls
from depthwalk.api.scene import Scene
from depthwalk.errors import InputError
from depthwalk.scene.environment import SkyParams
from depthwalk.scene.schema import RepresentationName
from modes import AaName

SIZE = (96, 72)
MIDDLE = SIZE[1] // 2, SIZE[0] // 2

pytestmark = pytest.mark.usefixtures("gl_device")


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_balls(tmp_path_factory.mktemp("balls"))


@pytest.fixture
def scene(scene_file: Path) -> Scene:
    return dw.load_scene(scene_file)


def drawn_at(scene: Scene | None, image: dw.Image) -> dict[int, tuple[Any, Any, int]]:
    """By object: the mean column and row of its pixels, parts of the picture from its middle to its right and upper
    edge, and how many there are."""
    assert image.object_id is not None
    height, width = image.object_id.shape
    places = {}
    for number in set(np.unique(image.object_id).tolist()) - {-1}:
        rows, columns = np.nonzero(image.object_id == number)
        places[number] = 2 * columns.mean() / width - 1, 1 - 2 * rows.mean() / height, len(rows)
    return places


@pytest.mark.parametrize(
    ("representation", "aa"),
    [
        *((each, "none") for each in (None, "dpci", "mesh", "mesh-lod", "mesh-clusters", "dmesh")),
        # Which program draws the numbers depends on the representation alone, their size on the smoothing alone.
        *((each, aa) for aa in ("coverage", "ssaa", "msaa") for each in (None, "mesh")),
    ],
)
def test_every_pixel_tells_its_object(scene: Scene, representation: RepresentationName | None, aa: AaName) -> None:
    scene.settings.aa = aa
    with dw.Renderer(scene, SIZE, representation=representation) as renderer:
        image = renderer.render(object_id=True)
    places = drawn_at(scene, image)
    assert set(places) == {0, 1, 3, 4}  # 2 is behind 0
    assert places[0][0] == pytest.approx(0, abs=0.02) and places[4][0] > 0.4
    assert places[1][0] < -0.3 and places[3][0] > 0.3
    assert places[1][2] == pytest.approx(places[3][2], rel=0.1)
    assert image.object_id is not None
    ball = image.object_id == 0
    radius = 1 / 5 / np.tan(np.pi / 8) * SIZE[1] / 2  # pixels, a little less than what the ball covers
    assert np.pi * radius**2 < ball.sum() < 1.1 * np.pi * radius**2
    assert image.depth[ball].min() == pytest.approx(4, abs=0.03) and image.depth[ball].max() < 5.1
    assert np.isinf(image.depth[0]).all() and (image.object_id[-1] == -1).all() and image.depth[-1].max() < 5


def test_asking_for_objects_changes_no_picture(scene: Scene) -> None:
    with dw.Renderer(scene, SIZE) as renderer:
        plain, asked, again = renderer.render(), renderer.render(object_id=True), renderer.render()
    assert plain.object_id is None and again.object_id is None
    for image in (asked, again):
        assert (image.rgba == plain.rgba).all() and (image.depth == plain.depth).all()


def test_objects_of_several_parts_count_once(tmp_path: Path) -> None:
    file = write_balls(tmp_path)
    file.write_text(file.read_text().replace("layers: 1}", "layers: 1, parts: 2}"))
    scene = dw.load_scene(file)
    scene.settings.lod.magnification = 0  # no mesh stands in
    with dw.Renderer(scene, SIZE) as renderer:
        assert set(drawn_at(scene, renderer.render(object_id=True))) == {0, 1, 3, 4}


def test_meshes_in_one_place_but_turned_otherwise(tmp_path: Path) -> None:
    file = write_balls(tmp_path)
    file.write_text(
        "version: 1\nassets: {ball: {mesh: ball.ply}}\nobjects:\n"
        "  - {asset: ball, position: [-1.5, 0, 0], yaw: 10}\n  - {asset: ball, position: [1.5, 0, 0], scale: 0.5}\n"
    )
    camera = dw.Camera((0, 1, 6), (0, 1, 0), 0.9)
    with dw.Renderer(dw.load_scene(file), SIZE) as renderer:
        places = drawn_at(None, renderer.render(camera, object_id=True))
    assert places[0][0] < 0 < places[1][0] and places[0][2] > 3 * places[1][2]


def test_what_moves_is_elsewhere_in_the_next_picture(scene: Scene) -> None:
    with dw.Renderer(scene, SIZE) as first, dw.Renderer(scene, SIZE, reuse=True) as second:
        for renderer in (first, second):
            image = renderer.render(object_id=True)
            assert image.object_id is not None and image.object_id[MIDDLE] == 0
        scene.move("ball", position=(0, 20, 0))
        for renderer in (first, second):
            image = renderer.render(object_id=True)
            assert set(drawn_at(scene, image)) == {1, 2, 3, 4}
            assert image.depth[MIDDLE] > 7
    scene.move("ball", position=(0, 0, 0))  # nobody is left to be told


def test_background_may_be_left_out(scene: Scene) -> None:
    scene.environment.ground = None
    with dw.Renderer(scene, SIZE) as renderer:
        image = renderer.render(background=False)
    assert (image.rgba[0, :, 3] == 0).all() and image.rgba[(*MIDDLE, 3)] == 255


def test_without_a_camera_all_is_seen(tmp_path: Path) -> None:
    write_balls(tmp_path)
    scene = dw.load_scene(tmp_path / "ball.ply", overrides={"assets.model.dpci": "{resolution: 64, layers: 1}"})
    with dw.Renderer(scene, SIZE) as renderer:
        image = renderer.render(object_id=True)
        assert (renderer.render(renderer.frame_all()).rgba == image.rgba).all()
    assert image.object_id is not None
    assert image.object_id[MIDDLE] == 0 and (image.object_id[[0, -1]] == -1).all()


def test_all_is_seen_from_any_direction_and_where_it_was_moved(scene: Scene) -> None:
    with dw.Renderer(scene, SIZE) as renderer:
        before = renderer.frame_all((0, -1, 0))
        assert before.look.x == before.look.z == 0 and before.look.y < 0
        scene.move("ball", position=(300, 0, 0))
        assert renderer.frame_all((0, -1, 0)).position[0] > before.position[0] + 100
        for wrong in (0, 0, 0), (1, 2), (math.nan, 0, 0):
            with pytest.raises(dw.InputError, match=r"direction .*: must be three numbers"):
                renderer.frame_all(wrong)


def test_pictures_are_saved(scene: Scene, tmp_path: Path) -> None:
    with dw.Renderer(scene, SIZE) as renderer:
        image = renderer.render()
    image.save(tmp_path / "a.png")
    image.save(str(tmp_path / "a.jpg"))
    with Image.open(tmp_path / "a.png") as png, Image.open(tmp_path / "a.jpg") as jpeg:
        assert (np.asarray(png) == image.rgba).all()
        assert np.abs(np.asarray(jpeg).astype(int) - image.rgba[..., :3]).mean() < 2
    with pytest.raises(dw.InputError, match=r"must end in \.png, \.jpg or \.jpeg"):
        image.save(tmp_path / "a.gif")
    with pytest.raises(dw.InputError, match="does not exist"):
        image.save(tmp_path / "no" / "a.png")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": (0, 10)}, r"size \(0, 10\): must be a width and a height"),
        ({"size": 80}, "size 80: must be a width and a height, whole numbers of at least 1 pixel"),
        ({"size": (80.0, 60.0)}, r"size \(80\.0, 60\.0\): must be a width and a height"),
        ({"size": SIZE, "representation": "teapot"}, "representation 'teapot': must be one of mesh, dpci"),
    ],
)
def test_renderers_refuse(scene: Scene, options: dict[str, Any], message: str) -> None:
    with pytest.raises(dw.InputError, match=message):
        dw.Renderer(scene, **options)


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        (dw.Camera((0, 1, 5), (0, 1, 0), 60), r"fov 60 must be 0\.0175 to 2\.97 radians, that is 1 to 170 degrees"),
        (dw.Camera((0, 1, 5), (0, 1, 5), 1), "target must be elsewhere"),
        (dw.Camera((0, float("nan"), 5), (0, 1, 0), 1), "must be three finite numbers each"),
        (dw.Camera((0, 1), (0, 1, 0), 1), "must be three finite numbers each"),  # type: ignore[arg-type]
    ],
)
def test_cameras_that_see_nothing(scene: Scene, camera: dw.Camera, message: str) -> None:
    with dw.Renderer(scene, (8, 6), representation="mesh") as renderer, pytest.raises(dw.InputError, match=message):
        renderer.render(camera)


@pytest.mark.parametrize("camera", [(0, 1, 5), "front", {"position": (0, 1, 5)}])
def test_what_is_no_camera(scene: Scene, camera: Any) -> None:
    wrong = pytest.raises(TypeError, match="camera: must be a Camera, not ")
    with dw.Renderer(scene, (8, 6), representation="mesh") as renderer, wrong:
        renderer.render(camera)


@pytest.mark.parametrize("wrong", [dw.Pass, "light", None])
def test_what_is_no_pass(scene: Scene, wrong: Any) -> None:
    with pytest.raises(TypeError, match="passes: must hold objects of classes of Pass, not "):
        dw.Renderer(scene, (8, 6), passes=[*dw.default_passes(), wrong])


def test_what_is_no_scene_and_what_is_closed(scene: Scene, scene_file: Path) -> None:
    given: Any = scene_file
    for take in (lambda: dw.Renderer(given, (8, 6)), lambda: dw.view(given)):
        with pytest.raises(TypeError, match="must be a Scene, as load_scene returns it, not "):
            take()
    with dw.Renderer(scene, (8, 6), representation="mesh") as renderer:
        pass
    with pytest.raises(ValueError, match="renderer is closed"):
        renderer.render()
    with pytest.raises(ValueError, match="renderer is closed"):
        renderer.frame_all()


def test_nothing_is_printed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    file, stages = write_balls(tmp_path), []
    file.write_text(file.read_text().replace("resolution: 64", "resolution: 48"))
    scene = dw.load_scene(file)
    with dw.Renderer(scene, SIZE, progress=lambda asset, stage: stages.append((asset, stage))) as renderer:
        scene.move("ball", yaw=1)
        renderer.render(object_id=True)
    assert ("ball", "depth images") in stages
    with caplog.at_level(logging.INFO, "depthwalk"), dw.Renderer(scene, SIZE, representation="mesh"):
        pass
    assert "ball: reading" in caplog.messages
    assert capfd.readouterr() == ("", "")


def test_what_the_ground_hides_is_not_seen(tmp_path: Path) -> None:
    file = write_balls(tmp_path)
    file.write_text(
        "version: 1\nassets: {ball: {mesh: ball.ply}}\nobjects:\n  - {asset: ball, position: [0, -1, 0]}\n"
        "environment: {ground: {}}\n"
    )
    camera = dw.Camera((0, 3, 6), (0, 0, 0), 0.6)
    with dw.Renderer(dw.load_scene(file), SIZE) as renderer:
        image = renderer.render(camera, object_id=True)
    assert image.object_id is not None
    rows = np.nonzero((image.object_id == 0).any(1))[0]
    assert image.object_id[MIDDLE] == 0
    assert 42 < rows.max() < 48  # where the ball goes into the ground; whole, it would reach row 53


def test_a_sky_becomes_a_picture_and_what_it_was(scene: Scene, tmp_path: Path) -> None:
    """Between two pictures; of what the other model has used, such as the sun's disc, nothing shows."""
    Image.new("RGB", (16, 8), (0, 255, 0)).save(picture := tmp_path / "green.png")
    environment = scene.environment
    environment.ground, environment.sun.direction = None, (0.0, -0.2, 1.0)
    environment.sky = sky = SkyParams(zenith=(1, 0, 0), horizon=(1, 0, 0), sun_size=20.0)
    with dw.Renderer(scene, SIZE) as renderer:
        painted = renderer.render().rgba
        sky.image = picture
        assert (renderer.render().rgba == painted).all()
        sky.model = "image"
        assert (renderer.render().rgba[0] == (0, 255, 0, 255)).all()
        sky.model = "gradient"
        assert (renderer.render().rgba == painted).all() and (painted[0, 0] == (255, 0, 0, 255)).all()
        sky.image = tmp_path / "none.png"
        sky.model = "image"
        with pytest.raises(InputError, match=r"none\.png"):
            renderer.render()

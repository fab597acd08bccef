"""What is imported when: the libraries that take long stay away from whoever does not need them."""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from fuzz.dae_files import skinned_dae

HEAVY = {
    "OpenEXR", "PIL", "embreex", "fast_simplification", "flip_evaluator", "glfw", "imageio_ffmpeg", "imgui_bundle",
    "moderngl", "moderngl_window", "networkx", "rich", "scipy", "skimage", "trimesh",
}  # fmt: skip
BAKING = {  # and what else no first picture of finished assets needs
    "depthwalk.assets.bake_job", "depthwalk.bake.axis", "depthwalk.bake.baker", "depthwalk.bake.levels",
    "depthwalk.bake.meso_file", "depthwalk.bake.panorama", "depthwalk.bake.parts", "depthwalk.bake.planar",
    "depthwalk.bake.raycast", "depthwalk.cook.edge_collapse", "depthwalk.cook.grid_lods",
    "depthwalk.ingest.range_image", "numpy.random",
}  # fmt: skip
MOST_MODULES = 25  # of depthwalk itself, to read a scene file

LOADED = """
import sys
{code}
print(*sorted(sys.modules))
"""
LOAD_SCENE = """
from depthwalk.scene.loader import load_scene
load_scene({scene!r})
"""
RUN = """
from depthwalk.commands.cli import app
try:
    app({arguments!r})
except SystemExit as end:
    assert not end.code
"""


@pytest.fixture
def loaded(cache_home: Path) -> Callable[..., Any]:
    """Runs code in a process of its own and returns the names of the modules that are loaded after it."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}

    def run(code: str) -> set[str]:
        command = [sys.executable, "-c", LOADED.format(code=code)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return set(done.stdout.splitlines()[-1].split())

    return run


@pytest.fixture
def obj_scene(tiny_scene: Path) -> Path:
    """As `tiny_scene`, of a tetrahedron in an OBJ file beside it."""
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    tiny_scene.with_name("ball.obj").write_text(text)
    tiny_scene.write_text(tiny_scene.read_text().replace("ball.ply", "ball.obj"))
    return tiny_scene


def test_the_package_imports_nothing_but_itself(loaded: Callable[..., Any]) -> None:
    modules = loaded("import depthwalk")
    assert not modules & (HEAVY | {"numpy", "pydantic", "typer"})
    assert {m for m in modules if m.startswith("depthwalk")} == {"depthwalk"}


def test_limits_and_errors_import_nothing_heavy(loaded: Callable[..., Any]) -> None:
    modules = loaded("import depthwalk.errors, depthwalk.limits")
    assert not modules & (HEAVY | {"numpy", "pydantic"})


@pytest.mark.slow
def test_reading_a_scene_imports_neither_gl_nor_mesh_libraries(loaded: Callable[..., Any], obj_scene: Path) -> None:
    modules = loaded(LOAD_SCENE.format(scene=str(obj_scene)))
    assert not modules & HEAVY
    assert sum(module.split(".")[0] == "depthwalk" for module in modules) <= MOST_MODULES


def test_reading_an_obj_file_imports_numpy_only(loaded: Callable[..., Any], obj_scene: Path) -> None:
    mesh = obj_scene.with_name("ball.obj")
    code = f"from pathlib import Path\nfrom depthwalk.ingest.loader import check_mesh\ncheck_mesh(Path({str(mesh)!r}))"
    assert not loaded(code) & HEAVY


def test_readers_of_interchange_files_are_imported_when_such_a_file_is_read(
    loaded: Callable[..., Any], obj_scene: Path
) -> None:
    meshes = [obj_scene.with_name("ball.obj"), obj_scene.with_name("joints.dae")]
    meshes[1].write_bytes(skinned_dae())
    code = "from pathlib import Path\nfrom depthwalk.ingest.loader import check_mesh\ncheck_mesh(Path({!r}))"
    without, having = (loaded(code.format(str(mesh))) for mesh in meshes)
    assert not {module for module in without if "interchange" in module or "xml" in module}
    assert {module for module in having if "interchange." in module} == {
        f"depthwalk.ingest.interchange.{name}"
        for name in ("collada", "collada_geometry", "collada_materials", "model", "reader", "xml_tree")
    }
    assert not having & HEAVY


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [["--help"], ["check", "--help"], ["render", "--help"]])
def test_help_imports_nothing_heavy(loaded: Callable[..., Any], arguments: Sequence[str]) -> None:
    assert not loaded(RUN.format(arguments=arguments)) & (HEAVY | {"numpy"})  # typer brings pydantic


@pytest.mark.slow
def test_check_imports_nothing_heavy(loaded: Callable[..., Any], obj_scene: Path) -> None:
    assert not loaded(RUN.format(arguments=["check", str(obj_scene)])) & HEAVY


@pytest.mark.slow
def test_info_of_a_mesh_imports_what_reads_it(loaded: Callable[..., Any], obj_scene: Path) -> None:
    mesh = obj_scene.with_name("ball.obj")
    assert loaded(RUN.format(arguments=["info", str(mesh)])) & HEAVY <= {"PIL", "scipy"}


@pytest.mark.slow
def test_the_window_takes_nothing_of_imgui_bundle_but_imgui(loaded: Callable[..., Any]) -> None:
    modules = loaded("import depthwalk.walk.app")
    assert "imgui_bundle._imgui_bundle.imgui" in modules
    assert not modules & {"imgui_bundle", "imgui_bundle.immapp", "asyncio", "ssl"}


@pytest.mark.slow
def test_imgui_bundle_can_still_be_imported_whole(loaded: Callable[..., Any]) -> None:
    code = "from depthwalk.walk.native_imgui import imgui\nimport imgui_bundle\nassert imgui_bundle.imgui is imgui"
    assert "imgui_bundle.immapp" in loaded(code)


@pytest.mark.slow
def test_the_window_opens_without_anything_that_bakes(loaded: Callable[..., Any]) -> None:
    modules = loaded("import depthwalk.commands.view, depthwalk.assets.background, depthwalk.walk.app")
    assert not modules & (BAKING | {"PIL.PngImagePlugin"})


@pytest.mark.gl
@pytest.mark.slow
def test_rendering_a_mesh_imports_nothing_that_bakes(loaded: Callable[..., Any], obj_scene: Path) -> None:
    options = ["-o", str(obj_scene.with_name("p.png")), "--representation", "mesh", "--resolution", "32,32", "--quiet"]
    modules = loaded(RUN.format(arguments=["render", str(obj_scene), *options]))
    assert not modules & (BAKING | {"scipy", "trimesh", "embreex", "networkx"})


def test_libraries_are_told_not_to_waste_time_unless_the_user_wants_it(loaded: Callable[..., Any]) -> None:
    code = (
        "import os, sys\nfrom depthwalk.commands.cli import main\n"
        "os.environ.pop('PYDANTIC_DISABLE_PLUGINS', None)\nos.environ['OPENBLAS_THREAD_TIMEOUT'] = '20'\n"
        "sys.argv = ['depthwalk', '--version']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "assert os.environ['PYDANTIC_DISABLE_PLUGINS'] == '__all__'\n"
        "assert os.environ['OPENBLAS_THREAD_TIMEOUT'] == '20'"
    )
    assert "numpy" not in loaded(code)

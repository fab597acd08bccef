"""What tests of several parts share: a GL device, a cache of their own, and a small scene on disk."""

import contextlib
import gc
import hashlib
import logging
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, settings
from platformdirs import user_cache_path

from depthwalk.errors import InputError

if TYPE_CHECKING:
    from depthwalk.gpu.device import Device

_STAGES = {".vert": "vertex", ".frag": "fragment"}
_PATIENT = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
settings.register_profile("quick", _PATIENT, max_examples=25, derandomize=True)  # the same ones every time
settings.register_profile("long", _PATIENT, max_examples=1000)
settings.load_profile("quick")  # unless --hypothesis-profile names another


def pytest_configure(config: pytest.Config) -> None:
    """With a process for each core, libraries need no threads of their own, which would wait for each other."""
    if getattr(config.option, "numprocesses", None):
        # Of llvmpipe, NumPy and SciPy, which are loaded later; without threads llvmpipe draws in the caller's.
        for library, threads in (("LP", "0"), ("OPENBLAS", "1"), ("OMP", "1")):
            os.environ.setdefault(f"{library}_NUM_THREADS", threads)
        # The C library gives memory of megabytes back at once, and the system clears each page that it hands out again:
        # with pictures and arrays made anew for each test, that is an eighth of the processor time. Read by processes
        # that start later, as workers do.
        for threshold, size in (("MMAP", 1 << 25), ("TRIM", 1 << 30)):
            os.environ.setdefault(f"MALLOC_{threshold}_THRESHOLD_", str(size))
        # Optimising shaders takes llvmpipe longer than drawing a few small pictures with them as they are.
        os.environ.setdefault("GALLIVM_PERF", "nopt")
    if folder := config.getoption("shaders"):
        _keep_shaders(Path(folder))


def _keep_shaders(folder: Path) -> None:
    """Write each program that is linked from now on into `folder`, one file for each of its two shaders.

    Other compilers can check them there: what Mesa accepts, drivers of GPUs may refuse.
    """
    import moderngl

    folder.mkdir(parents=True, exist_ok=True)
    link: Any = moderngl.Context.program

    def linked(context: moderngl.Context, **options: Any) -> moderngl.Program:
        program: moderngl.Program = link(context, **options)
        texts = {suffix: options.get(f"{stage}_shader") or "" for suffix, stage in _STAGES.items()}
        name = hashlib.sha256("".join(texts.values()).encode()).hexdigest()[:16]
        for suffix, text in texts.items():
            if text:
                (folder / name).with_suffix(suffix).write_text(text)
        return program

    setattr(moderngl.Context, "program", linked)  # noqa: B010 - mypy knows no other way to replace a method


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-goldens", action="store_true", help="replace tests/images and write difference sheets")
    parser.addoption("--as-gpu", action="store_true", help="have a software rasteriser do what a GPU does instead")
    parser.addoption("--shaders", metavar="FOLDER", help="write the text of all programs that tests link")
    parser.addoption(
        "--most-cpu", type=float, metavar="SECONDS", help="fail tests that take more of a processor and are not slow"
    )


# In this order: the first bench of a run waits for those of `render`.
_COMPILE = """
from depthwalk.cook import kernels as cook
from depthwalk.kernels import compiled_code
from depthwalk.render import kernels as render
for loops in (render, cook):
    if not compiled_code.is_complete(loops._FILES):
        loops.load()
"""
_compiler: subprocess.Popen[bytes] | None = None


def pytest_collection_finish(session: pytest.Session) -> None:
    """Compile the loops that tests will ask for in a process beside the first of several workers.

    So no worker has to wait for all of them, which take three quarters of a minute the first time.
    """
    global _compiler
    if os.environ.get("PYTEST_XDIST_WORKER") == "gw0" and any("kernels" in item.path.name for item in session.items):
        paths = os.pathsep.join(path for path in sys.path if path)
        run = [sys.executable, "-c", _COMPILE]
        _compiler = subprocess.Popen(run, env=os.environ | {"PYTHONPATH": paths}, stdin=subprocess.DEVNULL)


def pytest_unconfigure() -> None:
    """End the process that compiles, if the tests that need it were not reached."""
    if _compiler is not None:
        _compiler.kill()
        _compiler.wait()


def _cpu_seconds() -> float:
    """What this process has used of a processor, and what processes have that it started and that have ended."""
    used = os.times()
    return sum(used[:4])


@contextlib.contextmanager
def _where_samples_are() -> Iterator[None]:
    """Skip what asks for multisampling on a machine that cannot shade samples."""
    try:
        yield
    except InputError as error:
        if not str(error).startswith("render.aa: msaa needs"):
            raise
        pytest.skip("no shaders per sample here")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup() -> Generator[None, None, None]:
    """Skip tests whose fixtures need samples that the machine lacks."""
    with _where_samples_are():
        yield


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Fail what is not marked `slow` and takes long, where `--most-cpu` asks for it; fixtures do not count."""
    before = _cpu_seconds()
    with _where_samples_are():
        result = yield
    most, used = item.config.getoption("most_cpu"), _cpu_seconds() - before
    if most is not None and used > most and not any(map(item.get_closest_marker, ("slow", "gl", "window"))):
        pytest.fail(f"took {used:.2f} s of a processor: make it cheaper, or mark it slow", pytrace=False)
    return result


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keep the collector of garbage away from modules and tests, a million objects that stay: it looks at all of them
    again and again, which is two fifths of the time that collecting tests takes. Later it comes more rarely, as what
    tests leave behind is mostly gone without it."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 10, 20)
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what needs OpenGL by the fixture that it asks for; what makes a device in another way says so itself."""
    for item in items:
        if "gl_device" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.gl)


@pytest.fixture(scope="session")
def gl_device(pytestconfig: pytest.Config) -> "Device":
    """The headless device that all GL tests share; without one they are skipped, and say so."""
    from depthwalk.gpu.failures import GpuError
    from depthwalk.gpu.headless_device import headless_device

    try:
        device = headless_device()
    except GpuError as error:
        pytest.skip(f"no OpenGL here: {error}")
    if pytestconfig.getoption("as_gpu"):
        device.software = False
    return device


@pytest.fixture(autouse=True)
def _current_context(request: pytest.FixtureRequest) -> Iterator[None]:
    """Makes the shared device's context current again: a command run in between has made and dropped its own."""
    if "gl_device" not in request.fixturenames:
        yield
        return
    with request.getfixturevalue("gl_device").context:
        yield


@pytest.fixture(autouse=True)
def _logger_as_it_was() -> Iterator[None]:
    """A command sets up the package's logger for its own process, which here runs other tests, too."""
    log = logging.getLogger("depthwalk")
    before = log.handlers, log.propagate, log.level
    yield
    log.handlers, log.propagate, log.level = before


@pytest.fixture(autouse=True)
def _planned_by_numpy(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Benchmarks and windows load the compiled loops for their own process, which here runs other tests, too."""
    monkeypatch.setattr("depthwalk.render.kernels.load_behind", lambda: None)
    monkeypatch.setattr("depthwalk.cook.kernels.load_for", lambda triangles: None)
    yield
    for name in ("depthwalk.render.kernels", "depthwalk.cook.kernels"):
        if name in sys.modules:
            sys.modules[name].unload()


@pytest.fixture(scope="session", autouse=True)
def _interruptible() -> None:
    """What a shell starts in the background ignores SIGINT, which programs that tests start would inherit."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def cache_home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where baked and cooked objects are kept during the tests, for all processes, from before the first is baked."""
    import shapes  # here, as below: what only collects has no use for NumPy and the package

    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "cache"
    folder.mkdir(exist_ok=True)
    _share_compiled_loops(folder)
    with pytest.MonkeyPatch.context() as patch:
        if "MESA_SHADER_CACHE_DIR" not in os.environ:  # shaders are compiled once, wherever a test has its cache
            patch.setenv("MESA_SHADER_CACHE_DIR", str(user_cache_path()))
        patch.setenv("XDG_CACHE_HOME", str(folder))
        patch.setattr(shapes, "shared_folder", folder)
        yield folder


def _share_compiled_loops(folder: Path) -> None:
    """Let a cache `folder` have the loops that were compiled before, each state of their files in a folder of its own.

    They take half a minute, and are the same whoever compiles them.
    """
    from depthwalk.cache import cache_folder

    own, theirs = folder / "depthwalk" / "compiled", cache_folder().parent / "compiled"
    own.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(OSError):  # another worker did so, or this machine has no cache folder
        theirs.mkdir(parents=True, exist_ok=True)
        own.symlink_to(theirs, target_is_directory=True)


@pytest.fixture(scope="session", autouse=True)
def _small_atlas() -> Iterator[None]:
    """An atlas of 1024² holds 13 pictures of 320 × 240, where a picture in 4K has one for 4; llvmpipe clears the 67 MB
    and more of the program's smallest for every renderer, which is a third of a first picture's time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("depthwalk.render.tile_atlas.ATLAS_TEXELS", 1 << 20)
        yield


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own, for its programs too: empty, but for loops, which each of them would compile again."""
    folder = tmp_path / "cache"
    _share_compiled_loops(folder)
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    return folder


@pytest.fixture(scope="session", autouse=True)
def _one_thread(request: pytest.FixtureRequest) -> Iterator[None]:
    """Bakes in the calling thread where each core has a process already; tests of threads ask for some."""
    with pytest.MonkeyPatch.context() as patch:
        if "PYTEST_XDIST_WORKER" in os.environ:
            patch.setattr("depthwalk.parallel.default_workers", lambda processes=1: 1)
        yield


@pytest.fixture(scope="session")
def real_scenes() -> Path:
    """The folder of real models and scenes beside the checkout, which is not part of it."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "scenes"
    folder = Path(os.environ.get("DEPTHWALK_TEST_SCENES", beside))
    if not (folder / "bust.yaml").is_file():
        pytest.skip(f"no real scenes in {folder}")
    return folder


@pytest.fixture(scope="session")
def _ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The mesh of `tiny_scene`, of which each has a copy."""
    import shapes
    from files import write_ply

    return write_ply(tmp_path_factory.mktemp("ball") / "ball.ply", shapes.sphere(1.0, columns=64, rows=32))


@pytest.fixture
def tiny_scene(tmp_path: Path, _ball: Path) -> Path:
    """A scene file in a folder of its own with a ball of radius 1 (depth images of 64²) that stands on the origin,
    seen from 4 m, and beside it a path file `walk.yaml` of three frames."""
    folder = tmp_path / "scene"
    folder.mkdir()
    shutil.copyfile(_ball, folder / "ball.ply")
    (folder / "walk.yaml").write_text(
        "version: 1\nfps: 1\ninterpolation: step\nkeyframes:\n"
        "  - {time: 0, position: [0, 1, 4], target: [0, 1, 0], fov: 45}\n"
        "  - {time: 1, position: [4, 1, 0], target: [0, 1, 0], fov: 45}\n"
        "  - {time: 2, position: [0, 3, 4], target: [0, 1, 0], fov: 45}\n"
    )
    scene = folder / "scene.yaml"
    scene.write_text(
        "version: 1\n"
        "assets:\n"
        "  ball: {mesh: ball.ply, dpci: {resolution: 64, layers: 1}}\n"
        "objects:\n"
        "  - {asset: ball}\n"
        "camera: {position: [0, 1, 4], target: [0, 1, 0], fov: 45}\n"
    )
    return scene

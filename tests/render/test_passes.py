"""What passes may rely on and what is asked of them: targets, GL state, parameters; passes from outside the package."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.program import Program
from depthwalk.gpu.state import State
from depthwalk.ingest.mesh import Material
from depthwalk.params import Params, param
from depthwalk.render import occlusion_phases
from depthwalk.render.declared_targets import DeclaredTargets, declared
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.passes import PASSES, default_passes
from depthwalk.render.passes.ground import GroundPass
from depthwalk.render.renderer import Renderer
from depthwalk.render.target_table import TARGETS
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import CAPTURED, HEIGHT_FIELDS, Camera, Representation
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from fields import depths, field_library
from shapes import ShapeLibrary, box, panes, scene_of, sphere
from stage import OnScreen, set_all

SIZE = (96, 64)
VIEW = View(Camera((0.3, 1.5, 5.0), (0.0, 0.6, 0.0), 0.9), SIZE)
LAMP = {"position": (0, 3, 1), "direction": (0, -1, 0), "angle": 80, "range": 6, "shadow": True}
VIGNETTE = """
#include "common/brightness.glsl"
#include "corner.glsl"
uniform sampler2D lit_texture;
uniform float strength;
out vec4 colour;
void main() {
    vec4 lit = texelFetch(lit_texture, ivec2(gl_FragCoord.xy), 0);
    colour = vec4(lit.rgb * (1 - strength * corner(gl_FragCoord.xy / textureSize(lit_texture, 0))), lit.a);
}
"""
CORNER = "float corner(vec2 place) { return min(dot(place - 0.5, place - 0.5) * 2.0, 1.0); }\n"


class VignetteParams(Params):
    strength: float = param(1.0, "Part of the light that the corners lose", ge=0, le=1)


class Vignette(Pass[VignetteParams]):
    """As somebody would write it who uses the package."""

    name = "vignette"
    reads = ("lit",)
    writes = ("lit",)

    def __init__(self, shader: Path, params: VignetteParams | None = None) -> None:
        super().__init__(params)
        self._shader = shader

    def setup(self, gl: Scope) -> None:
        self._program = Program(gl, "common/fullscreen.vert", self._shader)

    def enabled(self, frame: Frame, params: VignetteParams) -> bool:
        return params.strength > 0

    def draw(self, frame: Frame, params: VignetteParams) -> None:
        frame.targets.lit_before().use(0)
        self._program.set(lit_texture=0, strength=params.strength)
        with self.gl.state(into=frame.targets.lit):
            self._program.fill()


class Careless(Pass[Params]):
    name = "careless"
    writes = ("lit",)
    touches = "surface"

    def setup(self, gl: Scope) -> None:
        pass

    def draw(self, frame: Frame, params: Params) -> None:
        with self.gl.state(into=frame.targets.lit, blend=(moderngl.ONE, moderngl.ONE), wireframe=True):
            getattr(frame.targets, self.touches)


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(0.6, 32, 16), box(0.8, 0.8, 0.8, (0, 0.4, 0))], resolution=64)


def still_life(**environment: Any) -> Scene:
    """Depth images, what is warped straight to the screen, a mesh."""
    places = ((0, (-1.2, 0.6, 0), 0.0, 1.0), (1, (0.2, 0, 0.3), 0.5, 1.0), (1, (1.6, 0, -0.4), -0.4, 1.0))
    scene = scene_of(*places, **environment)
    scene.objects.representation[1:] = Representation.DMESH, Representation.MESH
    return scene


@pytest.fixture
def shader(tmp_path: Path) -> Path:
    (tmp_path / "corner.glsl").write_text(CORNER)
    file = tmp_path / "vignette.frag"
    file.write_text(VIGNETTE)
    return file


def with_vignette(shader: Path, params: None = None) -> list[Any]:
    passes = default_passes()
    passes.insert(-1, Vignette(shader, params))
    return passes


@pytest.mark.gl
def test_a_pass_from_outside_changes_the_picture(library: ShapeLibrary, shader: Path) -> None:
    scene = still_life(background=(0.8, 0.8, 0.8))
    with HeadlessRenderer(scene, library, SIZE) as headless:
        headless.draw(VIEW)
        plain = headless.pixels().astype(int)
    with HeadlessRenderer(scene, library, SIZE, passes=with_vignette(shader)) as headless:
        headless.draw(VIEW)
        darkened = headless.pixels().astype(int)
        own = next(each for each in headless.renderer.passes if each.name == "vignette")
        own.params.strength = 0.0
        headless.draw(VIEW)
        np.testing.assert_array_equal(headless.pixels(), plain)
    assert (darkened[..., :3] <= plain[..., :3]).all()
    assert darkened[0, 0, 0] < 0.5 * plain[0, 0, 0]
    middle = np.s_[SIZE[1] // 2, SIZE[0] // 2]
    np.testing.assert_allclose(darkened[middle], plain[middle], atol=1)


def test_parameters_come_from_the_settings_unless_a_pass_has_its_own(shader: Path) -> None:
    settings = RenderSettings()
    settings.fxaa.edge_threshold = 0.3
    passes = {each.name: each for each in default_passes()}
    assert passes["fxaa"].params_in(settings) is settings.fxaa
    own = type(passes["fxaa"])(type(settings.fxaa)(edge_threshold=0.7))
    assert own.params_in(settings).edge_threshold == 0.7
    given = VignetteParams(strength=0.25)
    assert Vignette(shader, given).params_in(settings) is given
    assert Vignette(shader).params_in(settings) == VignetteParams()
    assert Vignette.Params is VignetteParams


def test_a_mistake_in_a_shader_from_outside_is_located(gl_device: Device, shader: Path) -> None:
    shader.write_text(VIGNETTE.replace("vec4 lit", "vec4 lot"))
    vignette = Vignette(shader)
    with pytest.raises(GpuError, match=r"vignette\.frag:9"):
        vignette.attach(gl_device)
    shader.unlink()
    with pytest.raises(GpuError, match=r"vignette\.frag: no such shader"):
        vignette.attach(gl_device)


def ground_of_its_own() -> GroundPass:
    return next(each for each in default_passes() if isinstance(each, GroundPass))


def test_a_pass_serves_one_renderer_at_a_time(gl_device: Device, library: ShapeLibrary) -> None:
    ground = ground_of_its_own()
    before = dict(gl_device.live)
    ground.attach(gl_device)
    with pytest.raises(ValueError, match="ground belongs to a renderer already"):
        ground.attach(gl_device)
    with OnScreen(gl_device, still_life(), library, SIZE) as stage:
        with pytest.raises(ValueError, match="mesh belongs to a renderer already"):
            Renderer(gl_device, still_life(), library, [ground_of_its_own(), stage.renderer.passes[0]])
        stage.draw(VIEW)  # the passes of the other renderer are as they were
    ground.release()
    assert {kind: count for kind, count in gl_device.live.items() if count} == {k: n for k, n in before.items() if n}
    ground.attach(gl_device)
    ground.release()


@pytest.mark.parametrize("touches", ["surface", "visibility", "lit_texture", "polygon"])
def test_undeclared_targets_are_out_of_reach_and_state_is_restored(
    gl_device: Device, library: ShapeLibrary, touches: str
) -> None:
    """Also after an exception."""
    careless = Careless()
    careless.touches = touches
    passes = default_passes()
    passes.insert(-1, careless)
    with OnScreen(gl_device, still_life(), library, SIZE, passes) as stage:
        with pytest.raises(AttributeError, match=r"careless.*(surface|visible|lit|polygon)"):
            stage.draw(VIEW)
        assert gl_device.state.now == State()
        assert not gl_device.context.wireframe
        passes.remove(careless)
        stage.renderer.passes.remove(careless)
        careless.release()
        stage.draw(VIEW)


def test_names_of_targets_are_checked(gl_device: Device) -> None:
    targets = Targets(gl_device, SIZE)
    with pytest.raises(ValueError, match="pass own: no target gbuffer"):
        declared(targets, "own", ("gbuffer",), ())
    targets.release()


def test_state_is_nested_and_the_mask_of_depth_restored(gl_device: Device) -> None:
    scope = gl_device.scope("test")
    target = scope.framebuffer([scope.texture((1, 1), 4)], scope.depth_texture((1, 1)))
    with scope.state(into=target, depth_test=">", cull=True, depth_write=False):
        with scope.state(cull=False, blend=(moderngl.ONE, moderngl.ONE)):
            assert gl_device.state.now == State(depth_test=">", blend=(moderngl.ONE, moderngl.ONE))
        assert gl_device.state.now == State(depth_test=">", cull=True)
        assert not target.depth_mask
    assert target.depth_mask
    assert gl_device.state.now == State()
    scope.release()


def test_what_does_not_draw_is_not_timed(gl_device: Device, library: ShapeLibrary) -> None:
    with OnScreen(gl_device, scene_of((0, (0, 0.6, 0), 0.0, 1.0)), library, SIZE) as stage:
        stage.renderer.timers.time_next()
        stage.draw(VIEW)
        while stage.renderer.timers.awaited(0):
            stage.draw(VIEW)
        timed = set(stage.renderer.timers.milliseconds)
    names = {each.name for each in PASSES}
    drawn = {name for timer in timed for name in timer.split(" + ")}
    assert drawn & names == {"warp", "composite", "material_resolve", "light", "output"}


def modes() -> Iterator[dict[str, Any]]:
    """Scenes and settings that between them have every pass do all it can."""
    for aa in ("none", "coverage", "msaa", "fxaa", "smaa", "gpaa", "gpaa-edge", "ssaa"):
        yield {"aa": aa}
    yield {"aa": "gpaa-edge", "gpaa.samples": 1}
    for mode in ("paper", "gather", "accumulate"):
        yield {"dof.mode": mode, "dof.samples": 2}
    yield {"ambient_occlusion.enabled": True}
    yield {"light.mode": "forward"}
    yield {"light.mode": "forward", "aa": "coverage"}
    yield {"light.mode": "warp"}
    yield {"light.mode": "warp", "aa": "msaa"}
    yield {"warp.order": "epipole"}
    yield {"shadows.enabled": False, "lamps": False}
    yield {"inspection.show": "normals"}
    yield {"inspection.show": "level"}
    yield {"fused": False, "inspection.show": "distance"}
    yield {"fused": False}


@pytest.mark.slow
def test_declared_targets_are_those_that_passes_use(
    gl_device: Device, library: ShapeLibrary, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing undeclared is used, or drawing raises; nothing is declared that no mode uses."""
    used = defaultdict(set)
    need = DeclaredTargets._need

    def noted(self: DeclaredTargets, target: str, use: str, allowed: frozenset[str]) -> None:
        need(self, target, use, allowed)
        used[self._user].add((target, use))

    monkeypatch.setattr(DeclaredTargets, "_need", noted)
    for mode in modes():
        lamps = [LAMP] if mode.pop("lamps", True) else []
        scene = still_life(sky={}, ground={"height": 0.0}, fog={"density": 0.02}, lights=lamps)
        if mode.get("aa") == "msaa" and gl_device.max_samples < 4:
            continue
        scene.render.shadows.enabled = True
        set_all(scene.render, mode)
        with OnScreen(gl_device, scene, library, SIZE) as stage:
            stage.draw(VIEW)
    alone = scene_of((0, (0, 0.6, 0), 0.0, 1.0))
    with OnScreen(gl_device, alone, library, SIZE) as stage:
        stage.draw(replace(VIEW))
    reliefs = scene_of(*[(0, (0, 0, 0), 0.0, 1.0)] * len(HEIGHT_FIELDS))
    reliefs.objects.representation[:] = HEIGHT_FIELDS
    with OnScreen(gl_device, reliefs, field_library(depths("cap")), SIZE) as stage:
        stage.draw(replace(VIEW))
    glass = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH, lights=[LAMP])
    glass.render.shadows.enabled = True
    with OnScreen(gl_device, glass, ShapeLibrary([panes((0.0, Material(opacity=0.5)))], [None]), SIZE) as stage:
        stage.draw(replace(VIEW))
    captured = still_life()
    captured.objects.representation[:] = *CAPTURED, Representation.MESH
    set_all(captured.render, {"octahedral.views": 4, "octahedral.resolution": 32, "billboard.resolution": 32})
    monkeypatch.setattr(occlusion_phases, "FIRST_PHASE", 1)  # so that meshes come after other objects, too
    with OnScreen(gl_device, captured, library, SIZE) as stage:
        stage.draw(VIEW)
    for each in PASSES:
        if gl_device.max_samples < 4 and each.name in ("sample", "resolve"):
            continue
        written = {target for target, use in used[each.name] if use in ("write", "test")}
        read = {target for target, use in used[each.name] if use in ("read", "test")}
        assert set(each.writes) <= written, each.name
        assert set(each.reads) <= read, each.name
        assert {target for target, _ in used[each.name]} <= {*each.reads, *each.writes} <= TARGETS.keys(), each.name

"""The declarations of targets and framebuffers, and the textures that are made by them."""

from collections.abc import Iterator

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.gpu.failures import GpuError
from depthwalk.render.declared_targets import declared
from depthwalk.render.passes import PASSES
from depthwalk.render.target_table import DEPTH24, FRAMEBUFFERS, TARGETS
from depthwalk.render.targets import Targets
from depthwalk.render.tile_atlas import TileAtlas, atlas_size

SIZE = (20, 12)
MADE = ("visibility", "surface", "depth", "material_depth", "shadow")


@pytest.fixture
def targets(gl_device: Device) -> Iterator[Targets]:
    made = Targets(gl_device, SIZE)
    yield made
    made.release()


def test_framebuffers_consist_of_declared_textures() -> None:
    textures = {name for target in TARGETS.values() for name in target.textures}
    for name, (colours, depth, _) in FRAMEBUFFERS.items():
        assert {*colours, *([depth] if depth else [])} <= textures, name


def test_every_target_is_written_and_read_by_a_pass() -> None:
    written = {name for pass_ in PASSES for name in pass_.writes}
    read = {name for pass_ in PASSES for name in pass_.reads}
    assert TARGETS.keys() - written == {"samples"}  # these are written as `visibility`, `surface` and so on
    assert TARGETS.keys() == read


def test_textures_have_the_declared_formats(targets: Targets) -> None:
    for name in MADE:
        for attribute, texture_format in TARGETS[name].textures.items():
            texture = getattr(targets, attribute)
            assert texture.size == SIZE
            if texture_format is not DEPTH24:
                assert (texture.components, texture.dtype) == (texture_format.components, texture_format.dtype)
            assert texture.depth == (texture_format is DEPTH24)


def test_with_one_sample_objects_are_drawn_into_the_gbuffer_itself(targets: Targets) -> None:
    assert targets.drawn.surface is targets.surface and targets.drawn.depth is targets.depth
    assert targets.defines == () and targets.offsets.tolist() == [[0, 0]]


def test_with_several_they_have_textures_of_their_own(gl_device: Device) -> None:
    if gl_device.max_samples < 4:
        pytest.skip("the device has fewer samples")
    several = Targets(gl_device, SIZE, 4)
    assert several.drawn.surface.samples == 4 and several.surface.samples == 0
    assert several.offsets.shape == (4, 2) and several.defines == ("MULTISAMPLED",)
    several.release()


def test_a_texture_that_is_refused_leaves_none_of_the_others(gl_device: Device) -> None:
    before = gl_device.live.copy()
    with pytest.raises(GpuError):
        Targets(gl_device, (1 << 20, 1))
    assert +gl_device.live == +before


def test_a_copy_of_the_light_outlives_what_is_drawn_over_it(targets: Targets) -> None:
    targets.lit.clear(0.25, 0.5, 0.75, 1.0)
    copy = targets.lit_before()
    targets.lit.clear()
    texels = np.frombuffer(copy.read(alignment=1), np.float16).reshape(-1, 4)
    assert texels == pytest.approx(np.tile([0.25, 0.5, 0.75, 1.0], (len(texels), 1)), abs=1e-3)


def test_a_pass_sets_only_what_it_writes(targets: Targets) -> None:
    own = declared(targets, "own", ("depth",), ("sun_maps",))
    own.sun_maps = None
    assert own.size == SIZE and own.depth is targets.depth
    with pytest.raises(AttributeError, match="pass own does not declare that it writes target lamp_maps"):
        own.lamp_maps = None
    with pytest.raises(AttributeError, match="pass own does not declare that it writes target material_depth"):
        own.material_depth  # noqa: B018


@pytest.mark.parametrize(
    ("size", "limit", "expected"),
    [((640, 480), 16384, (4096, 2048)), ((1920, 1080), 16384, (4096, 2048)), ((3840, 2160), 16384, (8192, 4096)),
     ((2000, 1200), 16384, (4096, 4096)), ((7680, 4320), 16384, (16384, 8192)), ((3840, 2160), 4096, (4096, 4096))],
)  # fmt: skip
def test_the_atlas_holds_four_pictures_where_it_can(
    monkeypatch: pytest.MonkeyPatch, size: tuple[int, int], limit: int, expected: tuple[int, int]
) -> None:
    monkeypatch.setattr("depthwalk.render.tile_atlas.ATLAS_TEXELS", 1 << 23)  # the program's smallest; tests have less
    assert atlas_size(size, limit) == expected


def test_the_atlas_takes_no_memory_before_it_is_used(gl_device: Device) -> None:
    before = gl_device.live["texture"]
    atlas = TileAtlas(gl_device, (64, 32), lit=True)
    assert gl_device.live["texture"] == before
    assert atlas.framebuffer.size == (64, 32) and gl_device.live["texture"] == before + 2
    assert atlas.lit_framebuffer.size == (64, 32) and gl_device.live["texture"] == before + 3
    atlas.release()
    assert gl_device.live["texture"] == before

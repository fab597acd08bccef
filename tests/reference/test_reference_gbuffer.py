"""What the G-buffer holds: as it was packed, in the shader as in its twin."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.limits import MAX_SHININESS
from depthwalk.reference.gbuffer import (
    is_reflecting,
    is_unlit,
    microfacets,
    packed_surfaces,
    reflecting_surfaces,
    unlit_surfaces,
    unpacked_surfaces,
)
from depthwalk.reference.light import Surfaces
from depthwalk.types import Array

_SIZE = 64
_PACK = """
#include "common/gbuffer.glsl"
uniform sampler2D colour_texture;   // linear, and specular strength
uniform sampler2D normal_texture;   // and shininess
layout(location = 0) out uvec2 words;
layout(location = 1) out vec4 colour;
layout(location = 2) out vec4 normal;
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    vec4 look = texelFetch(colour_texture, here, 0), facing = texelFetch(normal_texture, here, 0);
#ifdef REFLECTS
    words = reflecting_surface(look.rgb, look.a, facing.xyz, facing.w, vec3(look.a, 0.1, 0.9));
    bool told = is_reflecting(words) && !is_unlit(words);
    colour = vec4(albedo_of(words), told ? reflection_of(words).x : -1.0);
    normal = vec4(normal_of(words), told ? reflection_of(words).y : -1.0);
    return;
#endif
    words = packed_surface(look.rgb, look.a, facing.xyz, facing.w);
    colour = vec4(albedo_of(words), specular_of(words));
    bool known = is_lit(lit_surface(words)) && !is_unlit(lit_surface(words));
#ifdef UNLIT
    normal = vec4(normal_of(words), known && is_lit(words) && is_unlit(words) ? 1.0 : 0.0);
#else
    normal = vec4(normal_of(words), !known || is_lit(words) || is_unlit(words) ? 0.0 : shininess_of(words));
#endif
}
"""


def random_surfaces(count: int) -> Surfaces:
    """Surfaces of all colours that face all ways, the axes and edges of the octahedron among them."""
    rng = np.random.default_rng(3)
    normal = rng.normal(size=(count, 3))
    normal[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    normal[6:9] = (1, 1, 0), (1, -1, 0), (-1, 0, -1)
    colour, shininess = rng.random((count, 4)), MAX_SHININESS ** rng.random(count)
    colour[:2], shininess[:2] = ((0, 0, 0, 0), (1, 1, 1, 1)), (1, MAX_SHININESS)
    return Surfaces(
        albedo=colour[:, :3],
        specular=colour[:, 3],
        normal=normal / np.linalg.norm(normal, axis=1, keepdims=True),
        shininess=shininess,
    )


def angles(one: Array, other: Array) -> Array:
    """Angles between unit vectors, degrees; chords tell small ones apart, cosines do not."""
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(one - other, axis=1) / 2, 0, 1)))


def test_what_is_packed_is_unpacked() -> None:
    surfaces = random_surfaces(100_000)
    found = unpacked_surfaces(packed_surfaces(surfaces))
    assert np.abs(np.sqrt(found.albedo) - np.sqrt(surfaces.albedo)).max() <= 0.5 / 255 + 1e-9
    assert np.abs(found.specular - surfaces.specular).max() <= 0.5 / 255 + 1e-9
    assert angles(found.normal, surfaces.normal).max() < 0.06
    np.testing.assert_allclose(found.normal[:6], surfaces.normal[:6], atol=1e-12)  # along the axes
    assert np.abs(np.log(found.shininess / surfaces.shininess)).max() <= np.log(MAX_SHININESS) / 254 / 2 + 1e-9
    assert found.shininess[:2] == pytest.approx([1, MAX_SHININESS])


def packed(device: Device, folder: Path, surfaces: Surfaces, *defines: str) -> tuple[NDArray[np.uint32], Array, Array]:
    """Words (n, 2) that the shader packs of n surfaces, and what it unpacks again, (n, 4) each."""
    source = folder / "pack.frag"
    source.write_text(_PACK, encoding="utf-8")
    scope, size = device.scope("test"), (_SIZE, _SIZE)
    program = Program(scope, "common/fullscreen.vert", source, defines=defines)
    program.set(colour_texture=0, normal_texture=1)
    for unit, (vector, number) in enumerate(
        ((surfaces.albedo, surfaces.specular), (surfaces.normal, surfaces.shininess))
    ):
        texture = scope.texture(size, 4, "f4")
        texture.write(np.column_stack([vector, number]).astype(np.float32).tobytes())
        texture.use(unit)
    written = [scope.texture(size, 2, "u4"), scope.texture(size, 4, "f4"), scope.texture(size, 4, "f4")]
    with scope.state(into=scope.framebuffer(written)):
        program.fill()
    words = np.frombuffer(written[0].read(), np.uint32).reshape(-1, 2)
    colour, normal = (np.frombuffer(texture.read(), np.float32).reshape(-1, 4) for texture in written[1:])
    scope.release()
    return words, colour, normal


@pytest.mark.gl
@pytest.mark.parametrize("unlit", [False, True])
def test_the_shader_packs_as_its_twin(gl_device: Device, tmp_path: Path, unlit: bool) -> None:
    surfaces = random_surfaces(_SIZE**2)
    words, colour, normal = packed(gl_device, tmp_path, surfaces, *(("UNLIT",) if unlit else ()))
    twin = unlit_surfaces(packed_surfaces(surfaces)) if unlit else packed_surfaces(surfaces)
    found, expected = unpacked_surfaces(words), unpacked_surfaces(twin)
    assert (words == twin).all(1).mean() > 0.99  # the others fall between two steps
    assert (is_unlit(words) == unlit).all()
    assert np.abs(np.sqrt(found.albedo) - np.sqrt(expected.albedo)).max() < 1.5 / 255
    assert angles(found.normal, expected.normal).max() < 0.08
    np.testing.assert_allclose(colour, np.column_stack([found.albedo, found.specular]), atol=1e-6)
    known = np.ones(len(words)) if unlit else found.shininess
    np.testing.assert_allclose(normal, np.column_stack([found.normal, known]), rtol=1e-4, atol=1e-6)


@pytest.mark.gl
def test_the_shader_packs_what_reflects_as_its_twin(gl_device: Device, tmp_path: Path) -> None:
    """Metalness follows from the strength of highlights, here a tenth and nine tenths of `specular`."""
    surfaces = random_surfaces(_SIZE**2)
    words, colour, normal = packed(gl_device, tmp_path, surfaces, "REFLECTS")
    strength, reflects = 0.1 + 0.9 * surfaces.specular, is_reflecting(words)
    assert (reflects == (strength >= 0.15)).all()
    metalness = np.clip((strength - 0.3) / 0.7, 0, 1)
    twin = reflecting_surfaces(packed_surfaces(surfaces), surfaces.specular, metalness)
    assert (words == twin)[reflects].all(1).mean() > 0.98  # the others fall between two steps
    assert (words == packed_surfaces(surfaces))[~reflects].all(1).mean() > 0.99
    found, told = microfacets(words[reflects]), np.column_stack([colour, normal])[reflects]
    assert np.abs(found.roughness - surfaces.specular[reflects]).max() <= 0.5 / 49 + 1e-6
    assert np.abs(found.metalness - metalness[reflects]).max() <= 0.5 / 4 + 1e-6
    expected = np.column_stack([found.base, found.roughness, found.normal, found.metalness])
    np.testing.assert_allclose(told, expected, rtol=1e-4, atol=1e-6)
    assert not is_unlit(words).any()

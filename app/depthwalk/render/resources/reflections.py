"""Tell shaders how an object reflects the sky: the uniform `reflection` of shaders/common/gbuffer.glsl."""

from depthwalk.ingest.mesh import DIELECTRIC_HIGHLIGHT, Reflection

REFLECTS = "REFLECTS"
"""The define of shaders that write reflecting surfaces into the G-buffer."""
_ROUGHEST = 0.9  # beyond that, highlights are too weak to tell metal from the rest


def of_highlight(reflection: Reflection) -> tuple[float, float, float]:
    """Return the uniform for surfaces that are all equally metallic."""
    strength = DIELECTRIC_HIGHLIGHT + (1 - DIELECTRIC_HIGHLIGHT) * reflection.metalness
    return reflection.roughness, strength, 0.0


def of_texels(reflection: Reflection) -> tuple[float, float, float]:
    """Return the uniform for surfaces whose texels hold strengths of highlights, which tell how metallic each is.

    They were multiplied by 1 − roughness. Where hardly any is left, all are equally metallic.
    """
    if reflection.roughness > _ROUGHEST:
        return of_highlight(reflection)
    return reflection.roughness, 0.0, 1 / (1 - reflection.roughness)

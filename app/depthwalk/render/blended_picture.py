"""Choose the picture in which a pass blends pixels along edges: the lit one, or the finished one.

In the finished picture, pixels that are too bright are clipped to white before they are blended, as when several
samples of a pixel are averaged; and `output` need not read and write the whole picture once more, but shares a program
with the light. The lit picture must be blended instead where later passes change it (averaging of samples, depth of
field), where it is read after the frame, and where the screen is a window's, which has no texture.
"""

import moderngl

from depthwalk.render.depth_framebuffers import DepthFramebuffers
from depthwalk.render.frame import Frame


def blending_defines(frame: Frame) -> tuple[str, ...]:
    """Return the defines of shaders that include common/blending.glsl, for the picture that `frame` blends."""
    return ("SHOWN",) if frame.common.aa.shown else ()


def blended_picture(frame: Frame) -> moderngl.Framebuffer:
    """Return the framebuffer of the picture that `frame` blends."""
    return frame.targets.screen if frame.common.aa.shown else frame.targets.lit


def picture_before(frame: Frame) -> moderngl.Texture:
    """Return a copy of the picture that `frame` blends, as it is now."""
    return frame.targets.screen_before() if frame.common.aa.shown else frame.targets.lit_before()


def covered_pixels(frame: Frame, kept: DepthFramebuffers) -> moderngl.Framebuffer:
    """Return a framebuffer of the picture that `frame` blends, with the material depth to test against.

    kept: caches the one of the screen, which may be another in the next frame.
    """
    if not frame.common.aa.shown:
        return frame.targets.covered
    return kept.of("screen", blended_picture(frame), frame.targets.material_depth_texture)

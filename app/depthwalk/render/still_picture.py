"""Refine the picture of a viewer who stands still, in parts that each take no longer than a frame.

Each quarter of the picture is drawn with four samples per pixel, into targets as large as those of a frame. So objects
get the level of detail that four samples need, and no part takes more memory or time than a frame does.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import moderngl

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.render.antialiasing.modes import SUPERSAMPLING
from depthwalk.render.frame_memory import REFINED
from depthwalk.render.image import Image
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View


def quarters(view: View) -> Iterator[tuple[View, tuple[int, int]]]:
    """Return the views of the quarters of a picture.

    Where its width or height is odd, the last quarters reach beyond it by a pixel.

    Parameters
    ----------
    view : the view of the picture.

    Yields
    ------
    The view of a quarter at the picture's resolution, and how many pixels lie to its left and below it.
    """
    size = -(-view.size[0] // SUPERSAMPLING), -(-view.size[1] // SUPERSAMPLING)
    pixel = 1 / view.focal_pixels
    fov = 2 * math.atan(size[1] / 2 * pixel)
    for row in range(SUPERSAMPLING):
        for column in range(SUPERSAMPLING):
            left, below = column * size[0], row * size[1]
            right = (left + size[0] / 2 - view.size[0] / 2) * pixel
            up = (below + size[1] / 2 - view.size[1] / 2) * pixel
            shear = view.shear[0] - right, view.shear[1] - up
            yield replace(view, camera=replace(view.camera, fov=fov), size=size, shear=shear), (left, below)


class StillPicture:
    """Draw refined pictures, and keep the last one.

    Parameters
    ----------
    device : the GPU that draws.
    """

    def __init__(self, device: Device) -> None:
        self._gl = device.scope("still picture")
        self._picture: Image | None = None
        self._quarter: Image | None = None

    @cached_property
    def _place(self) -> Program:
        """Return the program, compiled for the first picture, so that opening the window does not wait for it."""
        return Program(self._gl, "common/fullscreen.vert", "still_picture/place.frag")

    def steps(self, renderer: Renderer, view: View) -> Iterator[str]:
        """Draw a picture step by step; the caller may stop after any step and drop it.

        Parameters
        ----------
        renderer : has drawn a frame of the same viewer before, in the same scene with the same settings.
        view : the view of the picture.

        Yields
        ------
        The name of the pass whose commands were just submitted to the GPU, see `Renderer.steps`.
        """
        for seen, corner in quarters(view):
            picture = self._picture = self._fitting(self._picture, view.size)
            quarter = self._quarter = self._fitting(self._quarter, seen.size)
            yield from renderer.auxiliary_steps(REFINED, seen, quarter.framebuffer)
            picture.framebuffer.viewport = (*corner, *seen.size)
            self._put(quarter, picture.framebuffer, corner)

    def show(self, screen: moderngl.Framebuffer) -> None:
        """Draw the picture into `screen`, which is as large. Raises ValueError before there is one."""
        if self._picture is None:
            raise ValueError("there is no picture yet")
        self._put(self._picture, screen, (0, 0))

    def _put(self, image: Image, into: moderngl.Framebuffer, corner: tuple[int, int]) -> None:
        image.texture.use(0)
        self._place.set(picture=0, corner=corner)
        with self._gl.state(into=into):
            self._place.fill()

    def _fitting(self, image: Image | None, size: tuple[int, int]) -> Image:
        """Return `image` if it has this size; otherwise free it and return a new one."""
        if image is not None and image.texture.size == size:
            return image
        if image is not None:
            image.free(self._gl)
        return Image.make(self._gl, size)

    def release(self) -> None:
        """Free everything on the GPU."""
        self._gl.release()
        self._picture = self._quarter = None

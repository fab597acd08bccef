"""Let a pass that looks at many pixels hand each on to those that follow, in the program that draws it.

What follows a pass of pixels is compiled into its program (`render.pixel_pass`). A pass that gathers colours from all
around cannot be such a function, but those behind it can be called where it has found one: then the picture between
them is never stored, nor read again.
"""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import moderngl

from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.pixel_pass import (
    DrawnPass,
    PixelPass,
    call_defines,
    joined_defines,
    joined_uniforms,
    passes_with_inputs,
)

P = TypeVar("P", bound=Params)


@dataclass(frozen=True, kw_only=True)
class ColourFunctions:
    """Hold the functions of passes that each map a colour, to be called one after the other.

    Attributes
    ----------
    into : what the last of them draws into.
    shaders : the files of the functions, to include before a program's own.
    defines : names to define; among them DRAW_PASSES, which calls the functions with a `Pixel`, and RESULT, what the
        last one makes of it.
    uniforms : the values of their uniforms.
    """

    into: moderngl.Framebuffer
    shaders: tuple[Any, ...]
    defines: tuple[str, ...]
    uniforms: Mapping[str, Any]

    @classmethod
    def of(cls, group: Sequence[DrawnPass]) -> "ColourFunctions":
        """Return those of `group`, passes that `maps_colour`; see `PixelPass`."""
        passes, inputs = passes_with_inputs(group)
        (target,) = passes[-1].writes
        return cls(
            into=getattr(group[-1].frame.targets, target),
            shaders=tuple(each.shader for each in passes),
            defines=(*joined_defines(inputs), *call_defines(passes)),
            uniforms=joined_uniforms(inputs),
        )


class PixelSource(Pass[P]):
    """Draw into `lit` what passes behind, that map its colours alone, may take on in the same program."""

    def fuses_with_next(self, frame: Frame, params: P) -> bool:
        """Return whether passes behind may be drawn together with this one; by default True.

        Parameters
        ----------
        frame : what to draw.
        params : the pass's own parameters.

        Returns
        -------
        False where it draws `lit` and nothing else.
        """
        return True

    @abstractmethod
    def parts_with(self, frame: Frame, params: P, following: ColourFunctions) -> Iterator[None]:
        """Draw in parts as `parts` does, but what `following` make of the colours, into their target.

        Parameters
        ----------
        frame : what to draw, and the targets that this pass declares.
        params : the pass's own parameters.
        following : the functions of the passes behind.

        Yields
        ------
        None, between two parts.
        """


def maps_colour(drawn: DrawnPass) -> bool:
    """Return whether a pass maps the colour of `lit` alone, wherever it is in the picture."""
    return isinstance(drawn.pass_, PixelPass) and drawn.pass_.maps_colour

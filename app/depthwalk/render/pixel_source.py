"""Let a pass that looks at many pixels call the pixel passes behind it from within its own program.

Neighbouring pixel passes are functions that are compiled into one program (`render.pixel_pass`). A pass that gathers
colours from many pixels cannot be such a function, but it can call the functions behind it for each colour that it
finds. The picture between them is then neither stored nor read.
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
    into : the framebuffer that the last of them draws into.
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
        """Return the functions of `group`, passes for which `maps_colour` is true; see `PixelPass`."""
        passes, inputs = passes_with_inputs(group)
        (target,) = passes[-1].writes
        return cls(
            into=getattr(group[-1].frame.targets, target),
            shaders=tuple(pass_.shader for pass_ in passes),
            defines=(*joined_defines(inputs), *call_defines(passes)),
            uniforms=joined_uniforms(inputs),
        )


class PixelSource(Pass[P]):
    """Draw into `lit`; passes behind that only map its colours may share the program."""

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
        """Draw in parts as `parts` does, but map the colours by `following` and draw into their target.

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
    """Return whether a pass only maps colours of `lit`, regardless of where in the picture they are."""
    return isinstance(drawn.pass_, PixelPass) and drawn.pass_.maps_colour

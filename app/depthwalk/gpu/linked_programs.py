"""Keep linked programs that are not in use, for whoever needs the same ones again.

Compiling, linking and looking up the uniforms of a renderer's programs takes as long as drawing a small picture. When a
window opens another scene, or a script makes one renderer after the other, the new renderer needs the programs that the
last one has just released.
"""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import moderngl

_MOST_UNUSED = 64  # a renderer has some thirty, half of them in use


@dataclass(frozen=True, kw_only=True, eq=False)
class LinkedProgram:
    """Hold a linked program and what is known of its uniforms.

    gl: moderngl's program; uniforms: those that the compiler kept, by name; initial: their bytes after linking; held:
    values that were written to them since; give_back: called when it is released.
    """

    gl: moderngl.Program
    uniforms: Mapping[str, moderngl.Uniform]
    initial: Mapping[str, bytes]
    held: dict[str, Any] = field(default_factory=dict)
    give_back: Callable[["LinkedProgram"], None]

    def reset(self) -> None:
        """Write to the uniforms what they had after linking."""
        for name in self.held:
            self.uniforms[name].write(self.initial[name])
        self.held.clear()

    def release(self) -> None:
        """End the use of the program by its owner."""
        self.give_back(self)


class LinkedPrograms:
    """Link programs for a context, and keep those that were released last."""

    def __init__(self, context: moderngl.Context) -> None:
        """Start with no program."""
        self._context = context
        self._unused: dict[bytes, LinkedProgram] = {}  # by a hash of what was linked; the one released last at the end

    def linked(self, vertex: str, fragment: str, blocks: Mapping[str, int]) -> LinkedProgram:
        """Return a program whose uniforms have their initial values, and which nobody else uses.

        Parameters
        ----------
        vertex, fragment
            The text of its two shaders.
        blocks
            Binding points of uniform blocks by their names; those that are not named are bound to point 0.

        Raises
        ------
        moderngl.Error
            Where the compiler refuses the shaders; the message is its log.
        """
        key = hashlib.sha256("\0".join((vertex, fragment, repr(sorted(blocks.items())))).encode()).digest()
        if (known := self._unused.pop(key, None)) is not None:
            known.reset()
            return known
        program = self._context.program(vertex_shader=vertex, fragment_shader=fragment)
        members: dict[str, Any] = {name: program[name] for name in program}
        for name, binding in blocks.items():
            if name in members:
                members[name].binding = binding
        uniforms = {name: member for name, member in members.items() if isinstance(member, moderngl.Uniform)}
        initial = {name: uniform.read() for name, uniform in uniforms.items()}

        def give_back(program: LinkedProgram) -> None:
            self._keep(key, program)

        return LinkedProgram(gl=program, uniforms=uniforms, initial=initial, give_back=give_back)

    def _keep(self, key: bytes, program: LinkedProgram) -> None:
        """Keep a program that is no longer used, and release what there is too much of."""
        surplus = [self._unused.pop(key)] if key in self._unused else []
        self._unused[key] = program
        if len(self._unused) > _MOST_UNUSED:
            surplus.append(self._unused.pop(next(iter(self._unused))))
        for unused in surplus:
            unused.gl.release()

    def clear(self) -> None:
        """Release all programs that are not in use."""
        for program in self._unused.values():
            program.gl.release()
        self._unused.clear()

"""Restrict each pass to the targets that it declares, so that the declarations show everything that passes share."""

from typing import Any, cast

from depthwalk.render.target_table import FRAMEBUFFERS, TARGET_OF, TARGETS
from depthwalk.render.targets import Targets

_OPEN_TO_ALL = {"size", "samples", "atlas_size", "offsets", "defines"}  # numbers, which need no declaration


class DeclaredTargets:
    """Give a pass those attributes of `Targets` that belong to the targets that it declares.

    A framebuffer may be used by a pass that writes all its colours, and reads or writes its depth.

    Parameters
    ----------
    targets : the targets of the renderer.
    user : the name of the pass, for messages.
    reads : names of the targets that the pass reads.
    writes : names of the targets that the pass writes.

    Raises
    ------
    AttributeError
        Where an attribute is used that the pass does not declare; the message names pass and target.
    ValueError
        Where no target has one of the names.
    """

    def __init__(self, targets: Targets, user: str, reads: tuple[str, ...], writes: tuple[str, ...]) -> None:
        if unknown := {*reads, *writes} - TARGETS.keys():
            raise ValueError(f"pass {user}: no target {', '.join(sorted(unknown))}; there are {', '.join(TARGETS)}")
        values = {"_targets": targets, "_user": user, "_reads": frozenset(reads), "_writes": frozenset(writes)}
        values["_allowed"] = set()  # names checked already
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> Any:
        if name not in self._allowed:
            self._check(name)
            self._allowed.add(name)
        return getattr(self._targets, name)

    def _check(self, name: str) -> None:
        """Raise AttributeError where the pass does not declare the target that an attribute belongs to."""
        if name in FRAMEBUFFERS:
            colours, depth, _ = FRAMEBUFFERS[name]
            for texture in colours:
                self._need(TARGET_OF[texture], "write", self._writes)
            if depth is not None:
                use, targets = ("test", self._reads | self._writes) if colours else ("write", self._writes)
                self._need(TARGET_OF[depth], use, targets)
        elif name in TARGET_OF:
            self._need(TARGET_OF[name], "read", self._reads)
        elif name not in _OPEN_TO_ALL:
            raise AttributeError(f"pass {self._user}: no target {name}")

    def __setattr__(self, name: str, value: Any) -> None:
        self._need(TARGET_OF.get(name, name), "write", self._writes)
        setattr(self._targets, name, value)

    def _need(self, target: str, use: str, targets: frozenset[str]) -> None:
        """Raise AttributeError unless `target` is one of `targets`. use: "read", "write", or "test" against a depth."""
        if target not in targets:
            raise AttributeError(f"pass {self._user} does not declare that it {use}s target {target}")


def declared(targets: Targets, user: str, reads: tuple[str, ...], writes: tuple[str, ...]) -> Targets:
    """Return `targets` as the pass with the name `user` may use them.

    Parameters
    ----------
    targets : the targets of the renderer.
    user : the name of the pass, for messages.
    reads : names of the targets that the pass reads.
    writes : names of the targets that the pass writes.

    Returns
    -------
    A view of `targets` that raises AttributeError for all others.

    Raises
    ------
    ValueError
        Where no target has one of the names.
    """
    return cast(Targets, DeclaredTargets(targets, user, reads, writes))

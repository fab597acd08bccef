"""Read how the nodes of a glTF scene move in the first animation of its file.

glTF 2.0, section 3.11 and appendix C. What is malformed raises ValueError, TypeError or LookupError.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import matrices
from depthwalk.ingest.gltf import objects_under
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_channels import REST, TICK, Channel, normalised, read_channel
from depthwalk.ingest.gltf_pose import local_matrix

_MOST_KEYS = 10_000_000  # of all channels together: they take 300 MB
_FEWEST_SECONDS = 0.01  # what takes less is no movement
_DEEPEST = 64  # animated nodes that hang from each other: skeletons have half as many
_TRIED = 33  # moments of a movement at which its size is looked for

Header = dict[str, Any]
_Numbers = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class _Joint:
    """Hold a node that moves: its channels by property, and what the properties without a channel are."""

    rest: Mapping[str, tuple[float, ...]]
    channels: Mapping[str, Channel]

    def local(self, times: _Numbers) -> _Numbers:
        """Return the node's matrices (t, 4, 4) relative to its parent."""
        shift, turn, size = (
            self.channels[name].sample(times)
            if name in self.channels
            else np.tile(np.array(self.rest[name], np.float64), (len(times), 1))
            for name in REST
        )
        placed = np.tile(np.eye(4), (len(times), 1, 1))
        placed[:, :3, :3] = matrices(normalised(turn)) * size[:, None, :]
        placed[:, :3, 3] = shift
        return placed


@dataclass(frozen=True, kw_only=True)
class Movement:
    """Hold how a node, or what hangs from it, moves in the scene.

    Attributes
    ----------
    chain
        What is multiplied, from the root on: matrices (4, 4) of nodes that stand still, and those that move.
    end
        Seconds that the animation takes.
    """

    chain: tuple["_Numbers | _Joint", ...]
    end: float

    def matrices(self, times: _Numbers) -> _Numbers:
        """Return where it is at `times` (t,) seconds: (t, 4, 4), scene from node, for column vectors."""
        placed = np.tile(np.eye(4), (len(times), 1, 1))
        with np.errstate(all="ignore"):
            for link in self.chain:
                placed = placed @ (link.local(times) if isinstance(link, _Joint) else link)
        return placed

    def of(self, inside: _Numbers) -> "Movement":
        """Return the movement of what stands by the matrix `inside` (4, 4) in the node."""
        return replace(self, chain=_appended(self.chain, inside))

    @property
    def is_step(self) -> bool:
        """Whether it only jumps."""
        return all(channel.is_step for channel in self._channels())

    @property
    def key_count(self) -> int:
        """How many keyframes it depends on."""
        return sum(len(channel.times) for channel in self._channels())

    def sizes(self) -> _Numbers:
        """Return matrices (t, 4, 4) at some moments, at which, if at any, it is about as large as ever."""
        scaled = [channel.times[:_TRIED] for channel in self._channels() if channel.is_size]
        moments = np.concatenate([np.linspace(0, self.end, _TRIED), *scaled])
        return self.matrices(moments[: 4 * _TRIED])

    def times(self) -> _Numbers:
        """Return the moments (t,) of all keyframes, with the beginning and the end, and shortly before each jump.

        They are seconds, whole numbers of TICK, and ascend by more than 10 of them, for which some are left out.
        """
        listed = [np.array([0.0, self.end])]
        for channel in self._channels():
            listed.append(channel.times)
            if channel.is_step and not self.is_step:
                listed.append(channel.times - 20 * TICK)
        end = round(self.end / TICK)
        ticks = np.unique(np.clip(np.rint(np.concatenate(listed) / TICK), 0, end)).astype(np.int64)
        ticks = ticks[np.unique(ticks // 20, return_index=True)[1]]  # one of 20, then no two neighbours are close
        ticks = ticks[(np.diff(ticks, prepend=-20) > 10) & (end - ticks > 10)]
        return np.append(ticks, end) * TICK

    @property
    def joint_count(self) -> int:
        """How many nodes that move by themselves it hangs from, or is."""
        return sum(isinstance(link, _Joint) for link in self.chain)

    def _channels(self) -> list[Channel]:
        return [channel for link in self.chain if isinstance(link, _Joint) for channel in link.channels.values()]


def _appended(chain: tuple["_Numbers | _Joint", ...], link: "_Numbers | _Joint") -> tuple["_Numbers | _Joint", ...]:
    """Return a chain with a further link; matrices that follow each other become one."""
    if chain and not isinstance(link, _Joint) and not isinstance(chain[-1], _Joint):
        return *chain[:-1], chain[-1] @ link
    return *chain, link


@dataclass(frozen=True, kw_only=True)
class Animation:
    """Hold the first animation of a file.

    Attributes
    ----------
    end
        Seconds that it takes; 0 if nothing moves.
    joints
        What moves by itself, by the numbers of nodes.
    notes
        What of the file's animations is not here, a text each.
    """

    end: float
    joints: Mapping[int, _Joint]
    notes: tuple[str, ...]

    def movements(self, nodes: list[Header], world: Mapping[int, _Numbers]) -> dict[int, Movement]:
        """Return the movements of all nodes that move by themselves or hang from one that does, by their numbers.

        Parameters
        ----------
        nodes
            All nodes.
        world
            The matrices of those that are shown, parents first.
        """
        if not self.joints:
            return {}
        parent = {child: number for number in world for child in nodes[number].get("children", [])}
        found: dict[int, Movement] = {}
        for number in world:
            above = parent.get(number)
            link = self.joints.get(number)
            if above in found:
                chain = _appended(found[above].chain, link or local_matrix(nodes[number]))
            elif link is not None:
                chain = (link,) if above is None else (world[above], link)
            else:
                continue
            found[number] = Movement(chain=chain, end=self.end)
            if found[number].joint_count > _DEEPEST:
                raise ValueError(f"more than {_DEEPEST} animated nodes hang from each other")
        return found


def read_animation(header: Header, accessors: Accessors) -> Animation:
    """Read the first animation of a file.

    Parameters
    ----------
    header
        The JSON header. Nodes that the animation holds at one place are put there, in place.
    accessors
        Reads keyframes.

    Returns
    -------
    Animation
        What moves.

    Raises
    ------
    ValueError, TypeError, LookupError
        For damaged data: keyframes that do not ascend, that are not finite or too many.
    """
    animations = objects_under(header, "animations")
    if not animations:
        return Animation(end=0.0, joints={}, notes=())
    channels, others, end = _channels(header, animations[0], accessors)
    notes = list(_notes(animations, others))
    nodes, joints = header["nodes"], {}
    for number, of_node in channels.items():
        node = nodes[number]
        if "matrix" in node:
            raise ValueError(f"node {number} has a matrix and is animated")
        for name in [name for name, channel in of_node.items() if channel.is_still]:
            node[name] = of_node.pop(name).values[0].tolist()
        if of_node:
            rest = {name: tuple(map(float, node.get(name, value))) for name, value in REST.items()}
            joints[number] = _Joint(rest=rest, channels=of_node)
    if joints and end < _FEWEST_SECONDS:
        return Animation(end=0.0, joints={}, notes=(*notes, f"nothing moves: the animation takes only {end:g} s"))
    return Animation(end=round(end / TICK) * TICK, joints=joints, notes=tuple(notes))


def _channels(
    header: Header, animation: Header, accessors: Accessors
) -> tuple[dict[int, dict[str, Channel]], Counter[str], float]:
    """Return the channels of an animation by nodes and properties, how many others it has, and its seconds."""
    found: dict[int, dict[str, Channel]] = {}
    others: Counter[str] = Counter()
    end, keys = 0.0, 0
    samplers = animation["samplers"]
    for each in animation["channels"]:
        target = each["target"]
        if (number := target.get("node")) is None or target["path"] not in REST:
            others[target["path"]] += 1
            continue
        if not isinstance(number, int) or not 0 <= number < len(header["nodes"]):
            raise ValueError(f"there is no node {str(number)[:40]}")
        sampler = samplers[each["sampler"]]
        keys += int(header["accessors"][sampler["input"]]["count"])
        if keys > _MOST_KEYS:
            raise ValueError(f"an animation with more than {_MOST_KEYS} keyframes")
        channel = read_channel(header, sampler, target["path"], accessors)
        end = max(end, float(channel.times[-1]))
        found.setdefault(number, {})[target["path"]] = channel
    return found, others, end


def _notes(animations: list[Header], others: Counter[str]) -> list[str]:
    """Return what is not read of a file's animations."""
    notes = []
    if more := len(animations) - 1:
        notes.append(f"{more} {'animation is' if more == 1 else 'animations are'} left out, the first one stays")
    if others["weights"]:
        notes.append("shape keys do not move")
    if sum(others.values()) > others["weights"]:
        notes.append("of the animation, only positions, rotations and scales of nodes are kept")
    return notes

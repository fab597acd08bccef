"""A baked asset: the objects with depth images that together show one mesh."""

from dataclasses import dataclass

from depthwalk.bake.images import BakedObject


@dataclass(frozen=True)
class BakedModel:
    """What an asset's depth images come to.

    parts: at least one, each with its own cylinder, placed in the asset's frame; all have the same key. Neighbours hold
    the surface along their common edge both.
    """

    parts: tuple[BakedObject, ...]

    @property
    def key(self) -> str:
        """Hex digest of what it was made from."""
        return self.parts[0].key

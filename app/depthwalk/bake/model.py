"""Define a baked asset: the objects whose depth images together show one mesh."""

from dataclasses import dataclass

from depthwalk.bake.images import BakedObject


@dataclass(frozen=True, kw_only=True)
class BakedModel:
    """Hold an asset's depth images: the objects that together show one mesh.

    Attributes
    ----------
    parts
        At least one object, each with its own cylinder, placed in the asset's frame; all have the same key. Adjacent
        parts both hold the surface along their common edge.
    left_out
        The part of the mesh's visible surface that no image holds, 0 to 1, see `measure_left_out`; None if it was not
        measured.
    """

    parts: tuple[BakedObject, ...]
    left_out: float | None = None

    @property
    def key(self) -> str:
        """Return the hex digest of what the model was made from."""
        return self.parts[0].key

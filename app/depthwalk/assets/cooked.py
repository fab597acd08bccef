"""Provide cooked depth images: from the cache, or cooked now and kept there."""

import logging
from collections.abc import Callable
from typing import Protocol

from depthwalk.bake.model import BakedModel
from depthwalk.cook.cook import CookedObject, CookOptions, cook_object
from depthwalk.cook.cooked_file import find_cooked, keep_cooked

log = logging.getLogger(__name__)


class BakedSource(Protocol):
    """Describe where depth images come from, by the number of their asset."""

    def key(self, asset: int) -> str:
        """Return the key in the cache of the depth images of the asset numbered `asset`.

        It is "" where the cache is not to keep them.
        """
        ...

    def baked(self, asset: int) -> BakedModel | None:
        """Return the depth images of the asset numbered `asset`, baked if they must be; None where it has none."""
        ...


def cooked_objects(
    source: BakedSource,
    asset: int,
    options: CookOptions,
    *,
    again: bool = False,
    begin: Callable[[], None] = lambda: None,
) -> tuple[CookedObject, ...]:
    """Return the cooked depth images of an asset, one object for each part.

    Parameters
    ----------
    source
        Where its depth images come from.
    asset
        Its number there.
    options
        What is built of each object.
    again
        Whether to cook although the cache has them, because what it has cannot be loaded. The objects returned then
        hold their arrays in memory, so that a cache which fails again does no harm.
    begin
        Called when the cooking begins, if it does.

    Raises
    ------
    InputError
        For files that cannot be used.
    LookupError
        Where the asset has no depth images.
    """
    key = source.key(asset)
    found = find_cooked(key, options) if key and not again else None
    if found is not None:
        return found
    model = source.baked(asset)
    if model is None:
        raise LookupError(f"asset {asset} has no depth images")
    begin()
    objects = tuple(cook_object(part, options) for part in model.parts)
    key = source.key(asset)  # another one if the asset's file was replaced before it was baked
    if key:
        try:
            kept = keep_cooked(key, options, objects)
            return objects if again else kept
        except OSError as error:  # then they stay in memory
            log.warning("cannot keep cooked depth images: %s", error)
    return objects

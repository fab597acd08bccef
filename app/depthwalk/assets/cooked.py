"""Provide cooked depth images: from the cache, or cooked now and stored there."""

import logging
from collections.abc import Callable

from depthwalk.bake.model import BakedModel
from depthwalk.cook.cook import CookedObject, CookOptions, cook_object
from depthwalk.cook.cooked_file import find_cooked, keep_cooked
from depthwalk.files import reason

log = logging.getLogger(__name__)


def cooked_objects(
    key: Callable[[], str],
    baked: Callable[[], BakedModel | None],
    options: CookOptions,
    *,
    again: bool = False,
    begin: Callable[[], None] = lambda: None,
) -> tuple[CookedObject, ...]:
    """Return the cooked depth images of an asset, one object for each part.

    Parameters
    ----------
    key
        Returns the key of the asset's depth images in the cache; "" if the cache is not to store them. It is called
        again after `baked`, since the asset's file may have been replaced before it was baked.
    baked
        Returns the asset's depth images, baked if necessary; None if the asset has none. It is not called if the cache
        has the cooked objects.
    options
        What is built for each object.
    again
        Whether to cook even if the cache has the objects, because they cannot be loaded. The objects returned then hold
        their arrays in memory, so that a cache that fails again does no harm.
    begin
        Called when cooking begins; not called if the cache has the objects.

    Raises
    ------
    InputError
        For files that cannot be used.
    LookupError
        If the asset has no depth images.
    """
    name = key()
    found = find_cooked(name, options) if name and not again else None
    if found is not None:
        return found
    model = baked()
    if model is None:
        raise LookupError("the asset has no depth images")
    begin()
    objects = tuple(cook_object(part, options) for part in model.parts)
    name = key()
    if name:
        try:
            kept = keep_cooked(name, options, objects)
            return objects if again else kept
        except OSError as error:  # then they stay in memory
            log.warning("cannot store cooked depth images in the cache: %s", reason(error))
    return objects

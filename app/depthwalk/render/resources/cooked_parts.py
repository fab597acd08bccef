"""Number the parts of assets that depth images show, and keep each part's cooked data, in main memory."""

import logging
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from depthwalk.bake.images import BakedObject
from depthwalk.cook.cook import CookedObject, CookOptions
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.virtual_texture import VirtualTexture
from depthwalk.render.resources.library import Library
from depthwalk.types import Ints

log = logging.getLogger(__name__)

_Part = TypeVar("_Part", BakedObject, CookedObject)


class CookedParts:
    """Number the parts of assets from `first` on, in the order in which they are asked for.

    Smaller numbers are those of assets and their meshes. Numbers stay valid when cooked data are dropped.

    Parameters
    ----------
    library
        Provides the assets.

    Attributes
    ----------
    options
        How depth images are cooked; set it only before anything is cooked, or after `forget`.
    """

    def __init__(self, library: Library) -> None:
        self.options = CookOptions()
        self._library = library
        self._assets: list[int] = []  # of each part
        self._numbers: dict[int, range] = {}  # of each asset's parts
        self._cooked: dict[int, CookedObject] = {}

    def __len__(self) -> int:
        """Return one more than the largest number of an asset or part."""
        return len(self._library) + len(self._assets)

    @property
    def first(self) -> int:
        """Return the number of the first part; smaller numbers are those of assets."""
        return len(self._library)

    def asset_of(self, number: int) -> int:
        """Return the number of the asset that the part numbered `number` belongs to."""
        return self._assets[number - len(self._library)]

    def assets(self) -> Ints:
        """Return the number of the asset (n,) that each number belongs to, of an asset or of a part."""
        return np.array([*range(len(self._library)), *self._assets], np.int64)

    def knows(self, asset: int) -> bool:
        """Return whether `numbers` can answer for the asset numbered `asset` without reading depth images."""
        return asset in self._numbers

    def numbers(self, asset: int) -> range:
        """Return the numbers of the parts of an asset, reading and cooking it if necessary.

        Parameters
        ----------
        asset
            The number of the asset.

        Returns
        -------
        range
            One number for each part.
        """
        if asset not in self._numbers:
            objects, first = self._library.cooked(asset, self.options), len(self)
            self._assets += [asset] * len(objects)
            self._numbers[asset] = range(first, len(self))
            self._cooked.update(zip(self._numbers[asset], objects, strict=True))
        return self._numbers[asset]

    def cooked(self, number: int) -> CookedObject:
        """Return the part numbered `number` as it was cooked; its large arrays are not loaded yet."""
        if number not in self._cooked:
            asset = self.asset_of(number)
            self._cooked.update(self._by_number(asset, self._library.cooked(asset, self.options)))
        return self._cooked[number]

    def load(self, number: int) -> tuple[LodGeometry, VirtualTexture]:
        """Return geometry and texture of the part numbered `number`, cooking it again if the cache has lost them."""
        try:
            return self.cooked(number).load()
        except OSError:  # the cached file was lost or damaged since it was found
            return self._cook_again(number).load()

    def is_shipped_cooked(self, number: int) -> bool:
        """Return whether the part numbered `number` exists only in cooked form, without its depth images."""
        return self._library.is_shipped_cooked(self.asset_of(number))

    def baked(self, number: int) -> BakedObject:
        """Read the depth images that a part was cooked from.

        Parameters
        ----------
        number
            The number of the part.

        Returns
        -------
        BakedObject
            Its depth images, with pixels.

        Raises
        ------
        LookupError
            Where the asset no longer has depth images.
        """
        asset = self.asset_of(number)
        model = self._library.baked(asset)
        if model is None:
            raise LookupError(f"asset {asset} has no depth images")
        return self._part(model.parts, number)

    def forget(self) -> None:
        """Drop all cooked data; they are loaded again when asked for."""
        self._cooked.clear()

    def _cook_again(self, number: int) -> CookedObject:
        """Cook the asset of the part numbered `number` again, because the cache has lost its arrays.

        Returns that part with its arrays in memory, so that a cache that fails again does no harm.
        """
        asset = self.asset_of(number)
        objects = self._library.cooked(asset, self.options, again=True)
        self._cooked.update(self._by_number(asset, objects))
        return self._part(objects, number)

    def _by_number(self, asset: int, objects: tuple[CookedObject, ...]) -> dict[int, CookedObject]:
        """Return the cooked objects of an asset by the numbers of its parts, and warn unless there is one for each.

        The number of parts changes if the asset's file is replaced after numbers were assigned. The scene is still
        drawn, with the objects that `_part` picks.
        """
        numbers = self._numbers[asset]
        if len(objects) != len(numbers):
            log.warning(
                "the file of asset %d was replaced: it has %d parts now, not %d; reload the scene to show it correctly",
                asset,
                len(objects),
                len(numbers),
            )
        return {number: self._part(objects, number) for number in numbers}

    def _part(self, parts: Sequence[_Part], number: int) -> _Part:
        """Return which of an asset's `parts` has the number `number`; the last one, if there are too few."""
        return parts[min(number - self._numbers[self.asset_of(number)].start, len(parts) - 1)]

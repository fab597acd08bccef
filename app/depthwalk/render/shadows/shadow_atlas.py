"""Keep shadow maps as tiles of equal size in one texture, and find which of them must be drawn again."""

from collections.abc import Mapping

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.render.shadows.casters import ShadowMap


class ShadowAtlas:
    """Own a depth texture of shadow maps, and remember what each tile of it shows.

    Parameters
    ----------
    scope
        Owns the GL objects.
    columns
        Most tiles in a row.

    Attributes
    ----------
    texture
        The depth texture, which shaders compare with; None until `fit` creates it.
    """

    def __init__(self, scope: Scope, columns: int) -> None:
        self.texture: moderngl.Texture | None = None
        self._framebuffer: moderngl.Framebuffer | None = None
        self._scope, self._columns = scope, columns
        self._resolution = 0
        self._held: dict[int, ShadowMap] = {}  # by tile, in the order in which they were drawn

    def fit(self, tiles: int, resolution: int) -> moderngl.Texture:
        """Return the texture; if its size changes, it is created again and all maps must be drawn again.

        Parameters
        ----------
        tiles
            How many square tiles it must have room for.
        resolution
            Texels along an edge of a tile.

        Returns
        -------
        moderngl.Texture
            The depth texture.
        """
        columns = min(tiles, self._columns)
        size = columns * resolution, -(-tiles // self._columns) * resolution
        if self.texture is None or self.texture.size != size or self._resolution != resolution:
            self.release()
            self.texture = self._scope.depth_texture(size)
            self.texture.compare_func = "<="
            self.texture.filter = moderngl.LINEAR, moderngl.LINEAR
            self._framebuffer = self._scope.framebuffer([], self.texture)
            self._resolution = resolution
        return self.texture

    def stale(self, requested: Mapping[int, ShadowMap]) -> dict[int, ShadowMap]:
        """Return which of the `requested` maps the atlas does not hold; these must be drawn, each after `begin`.

        Parameters
        ----------
        requested
            The maps that a frame asks for, by the number of their tile.

        Returns
        -------
        dict[int, ShadowMap]
            Those that are out of date, by the number of their tile.
        """
        held = self._held
        same = {tile: map_ for tile, map_ in requested.items() if tile in held and map_.shows_same(held[tile])}
        held.update(same)  # a requested map equal to a provisional one makes that final; the order stays
        return {tile: map_ for tile, map_ in requested.items() if tile not in same}

    def shown(self, tile: int) -> ShadowMap:
        """Return the map that the tile numbered `tile` holds now, which may be that of an earlier frame."""
        return self._held[tile]

    def holds(self, tile: int, shadow_map: ShadowMap) -> bool:
        """Return whether a tile holds this very map, by the draws of which it was made."""
        held = self._held.get(tile)
        return (
            held is not None
            and held.grids is shadow_map.grids
            and held.meshes is shadow_map.meshes
            and shadow_map.sees_same(held)
        )

    def provisional(self, stale: Mapping[int, ShadowMap]) -> set[int]:
        """Return the tiles of those `stale` maps for which the atlas holds a provisional map at the same place."""
        held = self._held
        return {
            tile
            for tile, map_ in stale.items()
            if tile in held and held[tile].provisional and map_.sees_same(held[tile])
        }

    def waiting(self, stale: Mapping[int, ShadowMap], last: int | None = None) -> dict[int, ShadowMap]:
        """Return which of the `stale` maps may be redrawn some frames later.

        A map may wait if it follows what its tile shows (`ShadowMap.follows`). The nearest map, in tile 0, may not wait
        if its objects changed while it stayed in place, since a late shadow is noticed near by. If it only moved, as
        while the viewer walks, it may wait: meanwhile the next map covers what it does not reach. So may a map whose
        tile holds a provisional one.

        Parameters
        ----------
        stale
            The maps, as `stale` returns them.
        last
            The tile of the farthest map, if all others may wait however far they moved; None: maps that moved too far
            may not wait.

        Returns
        -------
        dict[int, ShadowMap]
            The maps that may wait, by the number of their tile, the one drawn longest ago first.
        """
        held = {tile: map_ for tile, map_ in self._held.items() if tile in stale}  # in the order of drawing
        return {
            tile: stale[tile]
            for tile, before in held.items()
            if stale[tile].follows(before, last is not None and tile < last)
            and (tile > 0 or before.provisional or not stale[tile].sees_same(before))
        }

    def begin(self, tile: int, shadow_map: ShadowMap) -> None:
        """Clear a tile before a map is drawn into it.

        Parameters
        ----------
        tile
            The number of the tile.
        shadow_map
            The map that the tile shows from now on.

        Raises
        ------
        ValueError
            Before the first `fit`.
        """
        framebuffer = self.framebuffer(tile)
        framebuffer.clear(depth=1.0, viewport=framebuffer.viewport)
        self._held.pop(tile, None)
        self._held[tile] = shadow_map  # now the last in the order of drawing

    def framebuffer(self, tile: int) -> moderngl.Framebuffer:
        """Return the framebuffer that draws into the tile numbered `tile`. Raises ValueError before the first `fit`."""
        if self._framebuffer is None:
            raise ValueError("the atlas has no texture yet")
        side = self._resolution
        self._framebuffer.viewport = tile % self._columns * side, tile // self._columns * side, side, side
        return self._framebuffer

    def forget(self) -> None:
        """Forget what the tiles hold, so that all maps are drawn again."""
        self._held.clear()

    def release(self) -> None:
        """Release the texture and its framebuffer; `fit` creates them again."""
        if self.texture is not None:
            self._scope.free(self._framebuffer, self.texture)
        self.texture = self._framebuffer = None
        self.forget()

"""Keep shadow maps as tiles of equal size in one texture, and know which of them must be drawn again."""

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
        How many tiles a row has at most.

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
        """Return the texture, created again where its size changes; all maps must then be drawn again.

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
        """Return which of some maps the atlas does not show yet, so that they must be drawn, each after `begin`.

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
        held.update(same)  # what looks the same as a provisional map is none any more; the order stays
        return {tile: map_ for tile, map_ in requested.items() if tile not in same}

    def shown(self, tile: int) -> ShadowMap:
        """Return the map that the tile numbered `tile` shows now, which an earlier frame may have asked for."""
        return self._held[tile]

    def provisional(self, stale: Mapping[int, ShadowMap]) -> set[int]:
        """Return the tiles of those `stale` maps that a provisional map stands for, at the same place."""
        held = self._held
        return {
            tile
            for tile, map_ in stale.items()
            if tile in held and held[tile].provisional and map_.sees_same(held[tile])
        }

    def waiting(self, stale: Mapping[int, ShadowMap], last: int | None = None) -> dict[int, ShadowMap]:
        """Return which of some stale maps may be shown as they are for some frames more.

        Those may that follow what their tile shows (`ShadowMap.follows`); but not the nearest, in tile 0, if its
        objects changed where it is: near by one sees that a shadow is late. If it only moved, as while somebody walks,
        it may wait as the others may: until then the next map holds what it does not reach. And so may one that a
        provisional map stands for.

        Parameters
        ----------
        stale
            The maps, as `stale` returns them.
        last
            The tile of the map that reaches farthest, where others may wait wherever they were; None: none may that
            moved too far.

        Returns
        -------
        dict[int, ShadowMap]
            Those, by the number of their tile, the one drawn longest ago first.
        """
        held = {tile: map_ for tile, map_ in self._held.items() if tile in stale}  # in the order of drawing
        return {
            tile: stale[tile]
            for tile, before in held.items()
            if stale[tile].follows(before, last is not None and tile < last)
            and (tile > 0 or before.provisional or not stale[tile].sees_same(before))
        }

    def begin(self, tile: int, shadow_map: ShadowMap) -> None:
        """Clear a tile, so that a map is drawn into it next.

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
        """Forget what the tiles show, so that all maps are drawn again."""
        self._held.clear()

    def release(self) -> None:
        """Release the texture and its framebuffer; `fit` makes them again."""
        if self.texture is not None:
            self._scope.free(self._framebuffer, self.texture)
        self.texture = self._framebuffer = None
        self.forget()

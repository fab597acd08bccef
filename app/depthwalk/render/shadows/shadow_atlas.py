"""The texture that holds shadow maps, as tiles of equal size, and what each shows."""

from collections.abc import Mapping

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.render.shadows.casters import ShadowMap


class ShadowAtlas:
    """texture: depth, which shaders compare with; None until it is first needed."""

    def __init__(self, scope: Scope, columns: int) -> None:
        self.texture: moderngl.Texture | None = None
        self._framebuffer: moderngl.Framebuffer | None = None
        self._scope, self._columns = scope, columns
        self._resolution = 0
        self._held: dict[int, ShadowMap] = {}

    def fit(self, tiles: int, resolution: int) -> moderngl.Texture:
        """Makes it hold so many tiles of resolution² texels; all are to be drawn again where it did not before."""
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

    def stale(self, wanted: Mapping[int, ShadowMap]) -> dict[int, ShadowMap]:
        """Those of the maps, by their tiles, that are not there; `begin` each and draw it."""
        there = self._held
        return {tile: each for tile, each in wanted.items() if tile not in there or not each.shows_same(there[tile])}

    def shown(self, tile: int) -> ShadowMap:
        """What a tile shows, which may be what was wanted of it before."""
        return self._held[tile]

    def due(self, wanted: Mapping[int, ShadowMap]) -> dict[int, ShadowMap]:
        """As `stale`, where frames follow one another: the first, those that cannot wait, and one more, drawn longest
        ago. Those left out show what was, a frame later for each of them."""
        stale = self.stale(wanted)
        waits = [tile for tile in self._held if tile > 0 and tile in stale and stale[tile].follows(self._held[tile])]
        return {tile: each for tile, each in stale.items() if tile not in waits[1:]}

    def begin(self, tile: int, shadow_map: ShadowMap) -> None:
        """Clears a tile, into which the map is drawn next."""
        if self._framebuffer is None:
            raise ValueError("the atlas has no texture yet")
        side = self._resolution
        viewport = tile % self._columns * side, tile // self._columns * side, side, side
        self._framebuffer.use()
        self._framebuffer.viewport = viewport
        self._framebuffer.clear(depth=1.0, viewport=viewport)
        self._held.pop(tile, None)
        self._held[tile] = shadow_map  # the last, in the order of drawing

    def forget(self) -> None:
        """All are to be drawn again."""
        self._held.clear()

    def release(self) -> None:
        if self.texture is not None:
            self._scope.free(self._framebuffer, self.texture)
        self.texture = self._framebuffer = None
        self.forget()

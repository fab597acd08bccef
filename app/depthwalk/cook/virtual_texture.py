"""Pack the texels of an object's depth images that drawing looks up into one small picture: a virtual texture.

Each image is stored in *mip tiers*: the image itself, a quarter of it along each axis, a quarter of that, and so on.
Tier t serves levels of detail 2t to 2t + 2. Of a tier only those *sub-tiles* of 4 × 4 texels are stored that may be
looked up. Connected sub-tiles stay together in a *chart*, with a border of half a sub-tile of their true surroundings,
which is as far as filtering reaches up to level 2; charts interlock in one picture. A table tells a shader how far each
*tile* of 2 × 2 sub-tiles was moved.

All box filters begin half a sub-tile before the image: texel i of a quarter covers texels 4i − 2 to 4i + 1.
"""

from dataclasses import dataclass, field
from itertools import accumulate, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import HAS_COORDINATES, BakedObject, DepthImage, Face
from depthwalk.cook.colour_pca import few_components
from depthwalk.cook.coordinate_fill import filled_coordinates
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.mask_packing import pack_masks
from depthwalk.cook.texel_encoding import image_texels
from depthwalk.cook.used_texels import SUB_TILE, tile_counts, used_sub_tiles
from depthwalk.parallel import Map
from depthwalk.types import Array, Ints, Mask

MAX_MIP_TIERS = 7  # of an image 4⁷ texels wide
LEVELS = 2  # of detail from one mip tier to the next; a texel of the last is a sub-tile
# Cosine between a ray and the surface's normal, below which a pixel's step along the surface grows no further in
# texture lookups. Normals are smoother than facets: of 0.02, 0.08, 0.15 and 0.25, this one gives pictures most like
# those of the mesh.
FLATTEST = 0.08
_LOD_ERROR = 0.5  # pixels, the default of `render.lod.error`: how far off the levels are that a pixel is drawn by
_MAX_CHART = 24  # sub-tiles: wider pieces are cut into charts, which pack better
_NOWHERE = np.iinfo(np.int16).min  # shift of a sub-tile that is not stored


@dataclass(frozen=True, kw_only=True)
class VirtualTexture:
    """Hold the used texels of all images of an object.

    Attributes
    ----------
    normals
        (H, W, 4) uint8, level 0 of a picture: object-frame normal, (normal + 1) / 2 as encoded by `encode_normals`, and
        the remainder of the depth, see `depth_code`. H and W are multiples of `SUB_TILE`.
    colours, tints, palette
        Level 0 of two pictures and their palette: √linear RGB and specular strength, see `ColourComponents`.
    table
        (images, rows, columns, 2) int16, an entry for each tile of each mip tier: the shift that takes a texel to its
        position, right and up, multiples of `SUB_TILE`, plus flags for the stored sub-tiles: 1 for the left and 2 for
        the right one, those of the lower row in the first number, of the upper row in the second. Sub-tiles that are
        not stored are looked up in the next mip tier that has them.
    first_rows
        `MAX_MIP_TIERS` numbers: the row of the table in which each mip tier begins.
    last_mip_tier
        The number of the coarsest mip tier; 0 is the finest.
    coordinates
        (H, W, 2) uint16, a picture of `DepthImage.coordinates`, zero except in the finest mip tier; empty if the object
        has no texture.
    texture
        (h, w, 3) uint8, the texture of the object, see `BakedObject.texture`; empty if it has none.
    colour_level
        The first level of `colours` and `tints` that a GPU needs while it has coordinates: 0, or `LEVELS` if all texels
        have coordinates.
    """

    normals: NDArray[np.uint8]
    colours: NDArray[np.int8] | NDArray[np.uint8]
    tints: NDArray[np.uint8]
    palette: NDArray[np.float32]
    table: NDArray[np.int16]
    first_rows: list[int]
    last_mip_tier: int
    coordinates: NDArray[np.uint16] = field(default_factory=lambda: np.zeros((0, 0, 2), np.uint16))
    texture: NDArray[np.uint8] = field(default_factory=lambda: np.zeros((0, 0, 3), np.uint8))
    colour_level: int = 0

    @property
    def has_coordinates(self) -> bool:
        """Return whether colours are looked up in a texture."""
        return self.coordinates.size > 0

    @property
    def bytes_with_mip_maps(self) -> int:
        """Return how many bytes the pictures take on the GPU, including mip-maps."""
        base = self.coordinates.nbytes + self.texture[..., 0].size * 16 // 3  # of four bytes a texel, and a third more
        colours = self.colours.nbytes + self.tints.nbytes
        levels = range(LEVELS + 1)
        return base + sum((self.normals.nbytes + colours * (k >= self.colour_level)) >> 2 * k for k in levels)


@dataclass(frozen=True)
class MipTier:
    """Hold one mip tier of an image.

    Attributes
    ----------
    texels
        (h, w, 8) uint16, see `image_texels`.
    period
        Columns after which the tier repeats, 0 if it does not.
    """

    texels: NDArray[np.uint16]
    period: int


@dataclass(frozen=True, kw_only=True)
class _Chart:
    """Hold sub-tiles of one mip tier that move together.

    image, mip_tier: numbers; corner: row and column of the first sub-tile; sub_tiles: (h, w) bool, those that it has.
    """

    image: int
    mip_tier: int
    corner: tuple[int, int]
    sub_tiles: Mask

    @property
    def stored(self) -> Mask:
        """What is stored for it: cells (h + 1, w + 1) of a sub-tile's size that begin half a sub-tile before it."""
        padded = np.pad(self.sub_tiles, 1)
        return padded[1:, 1:] | padded[:-1, 1:] | padded[1:, :-1] | padded[:-1, :-1]


def build_mip_tiers(baked: BakedObject) -> list[list[MipTier]]:
    """Return the mip tiers of each image of an object, the finest first: all texels, used or not."""
    return [_mip_tiers(image_texels(baked.cylinder, image), image.face) for image in baked.images]


def build_virtual_texture(
    baked: BakedObject, grids: LodGeometry, parallel: Map = map, mip_tiers: list[list[MipTier]] | None = None
) -> VirtualTexture:
    """Pack the texels that triangles look up into a virtual texture.

    Parameters
    ----------
    baked
        The object, whose images hold the texels.
    grids
        The triangles that look into the images.
    parallel
        `map`, or what `thread_map` yields to work in several threads.
    mip_tiers
        The result of `build_mip_tiers` for the object, if it is known.

    Returns
    -------
    VirtualTexture
        The texture of all images.
    """
    images = build_mip_tiers(baked) if mip_tiers is None else mip_tiers
    shapes = [tile_counts(mip_tier.texels.shape) for mip_tier in images[0]]
    charts = _charts(baked, grids, shapes, parallel)
    places, (height, width) = pack_masks([chart.stored for chart in charts])
    cells = np.zeros((height, width, SUB_TILE, SUB_TILE, 8), np.uint16)
    used = np.zeros((height, width), bool)
    for chart, (row, column) in zip(charts, places, strict=True):
        stored = chart.stored
        target = np.s_[row : row + stored.shape[0], column : column + stored.shape[1]]
        cells[target][stored] = _cells(images[chart.image][chart.mip_tier], chart.corner, stored.shape)[stored]
        used[target] |= stored
    texels = cells.swapaxes(1, 2).reshape(height * SUB_TILE, width * SUB_TILE, 8)
    colours = few_components(texels[..., 4:], used.repeat(SUB_TILE, 0).repeat(SUB_TILE, 1))
    table = _table(charts, places, shapes, len(images))
    rows = [rows for rows, _ in shapes] + [0] * (MAX_MIP_TIERS - len(shapes))
    return VirtualTexture(
        normals=texels[..., :4].astype(np.uint8),
        colours=colours.components,
        tints=colours.tints,
        palette=colours.palette,
        table=table,
        first_rows=[0, *accumulate(rows[:-1])],
        last_mip_tier=len(shapes) - 1,
        **_textured(baked, charts, places, (height, width)),
    )


def _textured(
    baked: BakedObject, charts: list[_Chart], places: list[tuple[int, int]], shape: tuple[int, int]
) -> dict[str, Any]:
    """Return the fields `coordinates` and `texture`; none for an object without a texture.

    places: row and column of each of `charts`; shape: rows and columns of the pictures; both in sub-tiles.
    """
    if baked.texture is None:
        return {}
    cells = np.zeros((*shape, SUB_TILE, SUB_TILE, 2), np.uint16)
    finest = [
        MipTier(filled_coordinates(image), image.depth.shape[1] if image.face is Face.SIDE else 0)
        for image in baked.images
    ]
    for chart, (row, column) in zip(charts, places, strict=True):
        if chart.mip_tier == 0:
            stored = chart.stored
            target = np.s_[row : row + stored.shape[0], column : column + stored.shape[1]]
            cells[target][stored] = _cells(finest[chart.image], chart.corner, stored.shape)[stored]
    coordinates = cells.swapaxes(1, 2).reshape(shape[0] * SUB_TILE, shape[1] * SUB_TILE, 2)
    level = LEVELS if all(_all_have_coordinates(image) for image in baked.images) else 0
    return {"coordinates": coordinates, "texture": baked.texture, "colour_level": level}


def _all_have_coordinates(image: DepthImage) -> bool:
    """Return whether every non-empty texel of `image` has texture coordinates."""
    if image.coordinates is None:
        return False
    return bool((np.isinf(image.depth) | (image.coordinates[..., 0] & HAS_COORDINATES > 0)).all())


def _mip_tiers(texels: NDArray[np.uint16], face: Face) -> list[MipTier]:
    """Return the image and its quarters, down to one of at most a sub-tile and its surroundings."""
    height, width = texels.shape[:2]
    mip_tiers = [MipTier(texels, width if face is Face.SIDE else 0)]
    levels = (max(height, width) - 1).bit_length()
    while len(mip_tiers) * LEVELS < levels:
        mip_tiers.append(_quarter(mip_tiers[-1]))
    return mip_tiers


def _quarter(mip_tier: MipTier) -> MipTier:
    """Return the next coarser mip tier: means of 4 × 4 texels."""
    height, width = ((size + SUB_TILE // 2 - 1) // SUB_TILE + 1 for size in mip_tier.texels.shape[:2])
    row, column = _texels_of_cells(mip_tier, (0, 0), (height, width))
    # Adding integers is much faster than taking means along two short axes.
    rows = mip_tier.texels.take(row, 0).reshape(height, SUB_TILE, -1, 8).sum(1, dtype=np.uint32)
    texels = rows.take(column, 1).reshape(height, width, SUB_TILE, 8).sum(2, dtype=np.uint32)
    return MipTier(np.round(texels / SUB_TILE**2).astype(np.uint16), mip_tier.period // SUB_TILE)


def _cells(mip_tier: MipTier, corner: tuple[int, int], shape: tuple[int, ...]) -> NDArray[np.uint16]:
    """Return cells (h, w, 4, 4, 8) of texels, from half a sub-tile before sub-tile `corner` on; shape: (h, w)."""
    row, column = _texels_of_cells(mip_tier, corner, shape)
    texels = mip_tier.texels[row[:, None], column]
    return np.asarray(texels.reshape(shape[0], SUB_TILE, shape[1], SUB_TILE, -1).swapaxes(1, 2))


def _texels_of_cells(mip_tier: MipTier, corner: tuple[int, int], shape: tuple[int, ...]) -> tuple[Ints, Ints]:
    """Return the rows (4h,) and columns (4w,) of the texels in cells; parameters as in `_cells`.

    Beyond its edges a mip tier repeats; if it has no period, its outermost texels do.
    """
    height, width = mip_tier.texels.shape[:2]
    rows, columns = (
        SUB_TILE * first - SUB_TILE // 2 + np.arange(SUB_TILE * count)
        for first, count in zip(corner, shape, strict=True)
    )
    columns = columns % mip_tier.period if mip_tier.period else columns.clip(0, width - 1)
    return rows.clip(0, height - 1), columns


def _charts(baked: BakedObject, grids: LodGeometry, shapes: list[tuple[int, int]], parallel: Map) -> list[_Chart]:
    """Return everything that is stored; shapes: rows and columns of tiles in each mip tier.

    The last tier is stored completely, so that nothing is ever missing. Surfaces that are hardly visible are looked up
    in the second finest.
    """
    from depthwalk.cook.interior_visibility import hardly_seen  # here: drawing already cooked objects casts no rays

    charts: list[_Chart] = []
    levels = _looking_up(grids.error / square_texel(baked), len(shapes))
    for mip_tier, sub_tiles in enumerate(used_sub_tiles(baked, grids, levels, parallel)):
        # With texture coordinates, colours of coarser tiers are much coarser still.
        if mip_tier == 0 and len(shapes) > 1 and baked.texture is None:
            sub_tiles &= ~hardly_seen(baked, grids, parallel).repeat(2, 1).repeat(2, 2)
        for rows, columns in shapes[1 : mip_tier + 1]:
            sub_tiles = _covered_quarter(sub_tiles, (2 * rows, 2 * columns))
        sub_tiles |= mip_tier == len(shapes) - 1
        for row, column in product(*(range(0, 2 * size, _MAX_CHART) for size in shapes[mip_tier])):
            for image, part in enumerate(sub_tiles[:, row : row + _MAX_CHART, column : column + _MAX_CHART]):
                charts += _cut_out(image, mip_tier, (row, column), part)
    return charts


def _looking_up(error: Array, mip_tiers: int) -> list[int]:
    """Return how many of the finest levels look up each mip tier or a finer one.

    A pixel that covers 2^k texels looks up level k − 1 of the texture, and is drawn by the coarsest level that is off
    by at most `_LOD_ERROR`. Levels that are drawn where a tier has faded by half into the next are left out. At least
    one level counts for each level of the texture.

    error: (levels,), of the levels, texels, ascending; mip_tiers: how many there are.
    """
    tiers = np.arange(mip_tiers)
    drawn = np.searchsorted(error, _LOD_ERROR * 2.0 ** (tiers * LEVELS + LEVELS))
    return [int(count) for count in np.minimum(np.maximum(drawn, (tiers + 1) * LEVELS + 1), len(error))]


def _covered_quarter(sub_tiles: Mask, shape: tuple[int, int]) -> Mask:
    """Return those sub-tiles (images, *shape) of a quarter on which sub-tiles (images, rows, columns) of its image lie.

    Each is as wide as a texel of the quarter, but begins in the middle of one.
    """
    covered = np.zeros((len(sub_tiles), *shape), bool)
    image, row, column = sub_tiles.nonzero()
    for above, beside in product((0, 1), repeat=2):
        rows, columns = (row + above) // SUB_TILE, (column + beside) // SUB_TILE
        covered[image, rows.clip(max=shape[0] - 1), columns.clip(max=shape[1] - 1)] = True
    return covered


def _cut_out(image: int, mip_tier: int, corner: tuple[int, int], sub_tiles: Mask) -> list[_Chart]:
    """Return a chart for each connected piece of sub-tiles (h, w), the first of which is at `corner`.

    All sub-tiles of a tile are in one chart, since they share an entry of the table.
    """
    from scipy.ndimage import find_objects, label

    tiles = sub_tiles[::2, ::2] | sub_tiles[1::2, ::2] | sub_tiles[::2, 1::2] | sub_tiles[1::2, 1::2]
    pieces = label(tiles)[0].repeat(2, 0).repeat(2, 1) * sub_tiles
    charts = []
    for number, (rows, columns) in enumerate(find_objects(pieces), start=1):
        first = corner[0] + rows.start, corner[1] + columns.start
        chart = _Chart(image=image, mip_tier=mip_tier, corner=first, sub_tiles=pieces[rows, columns] == number)
        charts.append(chart)
    return charts


def _table(
    charts: list[_Chart], places: list[tuple[int, int]], shapes: list[tuple[int, int]], images: int
) -> NDArray[np.int16]:
    """Return `VirtualTexture.table`; shapes: rows and columns of tiles in each mip tier."""
    shifts = [np.full((images, 2 * rows, 2 * columns, 2), _NOWHERE, np.int16) for rows, columns in shapes]
    for chart, (row, column) in zip(charts, places, strict=True):
        (first, left), (rows, columns) = chart.corner, chart.sub_tiles.shape
        shift = shifts[chart.mip_tier][chart.image, first : first + rows, left : left + columns]
        shift[chart.sub_tiles] = SUB_TILE * (column - left), SUB_TILE * (row - first)
    widest = shapes[0][1]
    entries = [_entries(shift) for shift in shifts]
    return np.concatenate([np.pad(tier, ((0, 0), (0, 0), (0, widest - tier.shape[2]), (0, 0))) for tier in entries], 1)


def _entries(shifts: NDArray[np.int16]) -> NDArray[np.int16]:
    """Return one entry for each tile from the shifts (images, rows, columns, 2) of its sub-tiles.

    The stored sub-tiles of a tile all have the same shift.
    """
    images, rows, columns, _ = shifts.shape
    sub_tiles = shifts.reshape(images, rows // 2, 2, columns // 2, 2, 2).swapaxes(2, 3)  # ending in row, column, axis
    stored = sub_tiles[..., 0] > _NOWHERE
    return np.asarray(sub_tiles.max((3, 4)) + stored @ np.array([1, 2]), np.int16)

"""The texels of an object's depth images that drawing looks up, packed: a virtual texture.

An image is stored as *segments*, itself and its quarters: segment s serves levels of detail 2s to 2s + 2. Of a segment
only those grains of 4 × 4 texels are stored that may be looked up. They keep together in charts, each with half a grain
of its true surroundings, which is as far as filtering reaches up to level 2; charts interlock in one picture. All box
filters begin half a grain before the image: texel i of a quarter covers texels 4i − 2 to 4i + 1.
"""

from dataclasses import dataclass
from itertools import accumulate, product

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import BakedObject, Cylinder, DepthImage, Face
from depthwalk.cook.colour_pca import few_components
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.used_texels import SUB_TILE, block_shape, used_sub_tiles

MAX_MIP_TIERS = 7  # of an image 4⁷ texels wide
LEVELS = 2  # of detail that a segment serves; a texel of the last is a grain
DEPTH_PERIOD = 128.0  # texels, after which depths repeat
_LENGTHS = 8  # of normals that are tried
_WIDEST = 24  # grains: wider pieces are cut into charts, which fit together better
_NOWHERE = np.iinfo(np.int16).min  # shift of a grain that is not stored


@dataclass(frozen=True)
class VirtualTexture:
    """normals: (H, W, 4) uint8, level 0 of a picture: (object normal + 1) / 2, see `encode_normals`, and the remainder
    of the depth, see `depth_code`. H and W are multiples of `SUB_TILE`.

    colours, tints, palette: √linear colour and specular strength as `page_colours.ColourComponents`, level 0 of two pictures.

    table: (images, rows, columns, 2) int16, for each block of 2 × 2 grains of each segment, right and up, what takes a
    texel to its place: a multiple of `SUB_TILE`, plus which grains are stored, 1 for the left and 2 for the right one: of
    the lower row in the first number, of the upper in the second. Others are looked up in the next segment that does.
    first_rows: where each segment's blocks begin in it, `MAX_MIP_TIERS` numbers; last_segment: the coarsest there is.
    """

    normals: NDArray[np.uint8]
    colours: NDArray[np.int8] | NDArray[np.uint8]
    tints: NDArray[np.uint8]
    palette: NDArray[np.float32]
    table: NDArray[np.int16]
    first_rows: list[int]
    last_mip_tier: int

    @property
    def bytes_with_mip_maps(self) -> int:
        """What the pictures take on the GPU."""
        size = self.normals.nbytes + self.colours.nbytes + self.tints.nbytes
        return sum(size >> 2 * level for level in range(LEVELS + 1))


@dataclass(frozen=True)
class _Segment:
    """texels: (h, w, 8) uint16, see `image_texels`; period: columns after which it repeats, 0 where it does not."""

    texels: NDArray[np.uint16]
    period: int


@dataclass(frozen=True)
class _Chart:
    """Grains of one segment that move together. corner: row and column of the first; grains: (h, w) bool."""

    image: int
    mip_tier: int
    corner: tuple[int, int]
    sub_tiles: NDArray[np.bool_]

    @property
    def cells(self) -> NDArray[np.bool_]:
        """What is stored for it, (h + 1, w + 1) cells of a grain's size that begin half a grain before it."""
        padded = np.pad(self.sub_tiles, 1)
        return padded[1:, 1:] | padded[:-1, 1:] | padded[1:, :-1] | padded[:-1, :-1]


def build_virtual_texture(baked: BakedObject, grids: LodGeometry) -> VirtualTexture:
    """The pages of all images of `baked`, with what the triangles of `grids` look up."""
    images = [_segments(image_texels(baked.cylinder, image), image.face) for image in baked.images]
    shapes = [block_shape(mip_tier.texels.shape) for mip_tier in images[0]]
    charts = _charts(baked, grids, shapes)
    places, (height, width) = _pack([chart.cells for chart in charts])
    cells = np.zeros((height, width, SUB_TILE, SUB_TILE, 8), np.uint16)
    used = np.zeros((height, width), bool)
    for chart, (row, column) in zip(charts, places, strict=True):
        stored = chart.cells
        there = np.s_[row : row + stored.shape[0], column : column + stored.shape[1]]
        cells[there][stored] = _cells(images[chart.image][chart.mip_tier], chart.corner, stored.shape)[stored]
        used[there] |= stored
    texels = cells.swapaxes(1, 2).reshape(height * SUB_TILE, width * SUB_TILE, 8)
    colours = few_components(texels[..., 4:], used.repeat(SUB_TILE, 0).repeat(SUB_TILE, 1))
    table = _table(charts, places, shapes, len(images))
    rows = [rows for rows, _ in shapes] + [0] * (MAX_MIP_TIERS - len(shapes))
    first_rows = [0, *accumulate(rows[:-1])]
    return VirtualTexture(texels[..., :4].astype(np.uint8), *colours, table, first_rows, len(shapes) - 1)


def image_texels(cylinder: Cylinder, image: DepthImage) -> NDArray[np.uint16]:
    """Texels (H, W, 8) of an image: four numbers as in `VirtualTexture.normals`; √linear colour and specular strength, of 65535.
    An empty one has those of the nearest used one, so that filtering meets no black, and the depth farthest off."""
    # Colours as square roots: 8 bits suffice, and one component may stand for them.
    colour = np.sqrt(np.maximum(image.albedo[..., :3], 0))
    shown = np.round(np.clip(np.concatenate([colour, image.albedo[..., 3:]], -1), 0, 1) * 65535).astype(np.uint16)
    solid = np.isfinite(image.depth)
    depth = np.where(solid, image.depth, 0) / FaceGrid.of(cylinder, image).longest_texel
    normal = np.zeros_like(image.normal, np.uint8)
    normal[solid] = encode_normals(image.normal[solid])
    texels = np.concatenate([normal, depth_code(depth)[..., None], shown], -1)
    if not solid.all() and solid.any():
        from scipy.ndimage import distance_transform_edt

        rows, columns = distance_transform_edt(~solid, return_distances=False, return_indices=True)
        texels = texels[rows, columns]
        texels[~solid, 3] ^= 128  # half the period farther
    return texels


def depth_code(depth: NDArray[np.floating]) -> NDArray[np.uint8]:
    """The remainders of depths, in texels, by `DEPTH_PERIOD`: in 8 bits whole depths would not tell surfaces a texel
    apart."""
    return np.round(depth * (256 / DEPTH_PERIOD)).astype(np.int64).astype(np.uint8)


def encode_normals(normal: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Unit vectors (n, 3) in 8 bits each, (normal + 1) / 2 but for their length: of those up to 11 % shorter, the one
    whose direction rounding changes least. That halves the error (Kaplanyan 2010, "CryENGINE 3: Reaching the Speed of
    Light")."""
    largest = np.abs(normal).max(1, keepdims=True).clip(1e-6)
    best, least = np.zeros(normal.shape, np.uint8), np.full(len(normal), np.inf)
    for shorter in range(_LENGTHS):
        # The largest component is exact.
        scale = (np.floor(127.5 * largest - 0.5) + 0.5 - shorter).clip(0.5) / largest
        code = np.floor(normal * scale + 128).clip(0, 255)
        decoded = code - 127.5
        off = np.square(decoded / np.linalg.norm(decoded, axis=1, keepdims=True) - normal).sum(1)
        better = off < least
        best[better], least[better] = code[better], off[better]
    return best


def _segments(texels: NDArray[np.uint16], face: Face) -> list[_Segment]:
    """The image and its quarters, down to one of at most a grain and what is beside it."""
    height, width = texels.shape[:2]
    mip_tiers = [_Segment(texels, width if face is Face.SIDE else 0)]
    levels = (max(height, width) - 1).bit_length()
    while len(mip_tiers) * LEVELS < levels:
        mip_tiers.append(_quarter(mip_tiers[-1]))
    return mip_tiers


def _quarter(mip_tier: _Segment) -> _Segment:
    height, width = ((size + SUB_TILE // 2 - 1) // SUB_TILE + 1 for size in mip_tier.texels.shape[:2])
    texels = _cells(mip_tier, (0, 0), (height, width)).mean((2, 3), dtype=np.float32)
    return _Segment(np.round(texels).astype(np.uint16), mip_tier.period // SUB_TILE)


def _cells(mip_tier: _Segment, corner: tuple[int, int], shape: tuple[int, ...]) -> NDArray[np.uint16]:
    """(h, w) = `shape` cells (h, w, 4, 4, 8) of texels, from half a grain before grain `corner` on. Beyond its edges a
    segment repeats or, where it has no period, its outermost texels do."""
    height, width = mip_tier.texels.shape[:2]
    rows, columns = (
        SUB_TILE * first - SUB_TILE // 2 + np.arange(SUB_TILE * count)
        for first, count in zip(corner, shape, strict=True)
    )
    columns = columns % mip_tier.period if mip_tier.period else columns.clip(0, width - 1)
    found = mip_tier.texels[rows.clip(0, height - 1)[:, None], columns]
    return found.reshape(shape[0], SUB_TILE, shape[1], SUB_TILE, -1).swapaxes(1, 2)


def _charts(baked: BakedObject, grids: LodGeometry, shapes: list[tuple[int, int]]) -> list[_Chart]:
    """All that is stored; shapes: of each segment, in blocks. The last is whole, so that nothing is ever missing."""
    charts: list[_Chart] = []
    # A pixel that covers 2^k texels is drawn by grids up to the k-th after the first, and looks up level k − 1. The
    # last before the next segment is drawn where this one has all but given way to that.
    levels = [(mip_tier + 1) * LEVELS + 1 for mip_tier in range(len(shapes))]
    for mip_tier, sub_tiles in enumerate(used_sub_tiles(baked, grids, levels)):
        for rows, columns in shapes[1 : mip_tier + 1]:
            sub_tiles = _covered_quarter(sub_tiles, (2 * rows, 2 * columns))
        sub_tiles |= mip_tier == len(shapes) - 1
        for row, column in product(*(range(0, 2 * size, _WIDEST) for size in shapes[mip_tier])):
            for image, part in enumerate(sub_tiles[:, row : row + _WIDEST, column : column + _WIDEST]):
                charts += _cut_out(image, mip_tier, (row, column), part)
    return charts


def _covered_quarter(sub_tiles: NDArray[np.bool_], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Those grains (images, *shape) of the quarter that `sub_tiles` (images, rows, columns) lie on: each is as wide as a
    texel there but begins in the middle of one."""
    covered = np.zeros((len(sub_tiles), *shape), bool)
    image, row, column = sub_tiles.nonzero()
    for above, beside in product((0, 1), repeat=2):
        rows, columns = (row + above) // SUB_TILE, (column + beside) // SUB_TILE
        covered[image, rows.clip(max=shape[0] - 1), columns.clip(max=shape[1] - 1)] = True
    return covered


def _cut_out(image: int, mip_tier: int, corner: tuple[int, int], sub_tiles: NDArray[np.bool_]) -> list[_Chart]:
    """A chart for each connected piece of some grains (h, w) from grain `corner` on. One holds all of a block."""
    from scipy.ndimage import find_objects, label

    blocks = sub_tiles[::2, ::2] | sub_tiles[1::2, ::2] | sub_tiles[::2, 1::2] | sub_tiles[1::2, 1::2]
    pieces = label(blocks)[0].repeat(2, 0).repeat(2, 1) * sub_tiles
    charts = []
    for number, (rows, columns) in enumerate(find_objects(pieces), start=1):
        first = corner[0] + rows.start, corner[1] + columns.start
        charts.append(_Chart(image, mip_tier, first, pieces[rows, columns] == number))
    return charts


def _pack(masks: list[NDArray[np.bool_]]) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Row and column for each mask in one picture in which they do not overlap, and its height and width.

    Large ones first, each goes to the lowest place where it fits: masks of any shape fill each other's bays.
    """
    width = max(int(np.sqrt(sum(mask.sum() for mask in masks))), *(mask.shape[1] for mask in masks))
    taken = np.zeros((sum(mask.shape[0] for mask in masks), width), np.float32)
    places = [(0, 0)] * len(masks)
    height = 0
    for number in sorted(range(len(masks)), key=lambda number: int(masks[number].sum()), reverse=True):
        rows, columns = masks[number].shape
        overlap = _overlaps(taken[: height + rows], masks[number].astype(np.float32))
        row, column = divmod(int((overlap < 0.5).argmax()), overlap.shape[1])
        taken[row : row + rows, column : column + columns] += masks[number]
        places[number] = row, column
        height = max(height, row + rows)
    return places, (height, width)


def _overlaps(taken: NDArray[np.float32], mask: NDArray[np.float32]) -> NDArray[np.float32]:
    """Count the taken cells that `mask` (h, w) would cover at each place in `taken` (H, W).

    Returns (H − h + 1, W − w + 1), whole numbers but for the rounding of the Fourier transform. A circular correlation
    does: no place at which the mask lies inside reaches round the edge. `scipy.signal.fftconvolve` does the same with
    a transform four times as large, and importing it takes a second.
    """
    from scipy.fft import irfft2, next_fast_len, rfft2

    shape = [next_fast_len(side, real=True) for side in taken.shape]
    counts = irfft2(rfft2(taken, shape) * rfft2(mask, shape).conj(), shape)
    return np.asarray(counts[: taken.shape[0] - mask.shape[0] + 1, : taken.shape[1] - mask.shape[1] + 1])


def _table(
    charts: list[_Chart], places: list[tuple[int, int]], shapes: list[tuple[int, int]], images: int
) -> NDArray[np.int16]:
    """`VirtualTexture.table`; shapes: rows and columns of blocks in each segment."""
    shifts = [np.full((images, 2 * rows, 2 * columns, 2), _NOWHERE, np.int16) for rows, columns in shapes]
    for chart, (row, column) in zip(charts, places, strict=True):
        (first, left), (rows, columns) = chart.corner, chart.sub_tiles.shape
        there = shifts[chart.mip_tier][chart.image, first : first + rows, left : left + columns]
        there[chart.sub_tiles] = SUB_TILE * (column - left), SUB_TILE * (row - first)
    widest = shapes[0][1]
    entries = [_entries(shift) for shift in shifts]
    return np.concatenate([np.pad(each, ((0, 0), (0, 0), (0, widest - each.shape[2]), (0, 0))) for each in entries], 1)


def _entries(shifts: NDArray[np.int16]) -> NDArray[np.int16]:
    """Of each block, one entry for the shifts (images, rows, columns, 2) of its grains: those that are stored agree."""
    images, rows, columns, _ = shifts.shape
    sub_tiles = shifts.reshape(images, rows // 2, 2, columns // 2, 2, 2).swapaxes(2, 3)  # ending in row, column, axis
    stored = sub_tiles[..., 0] > _NOWHERE
    return (sub_tiles.max((3, 4)) + stored @ np.array([1, 2])).astype(np.int16)

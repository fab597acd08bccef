"""The texels of an object's depth images that drawing looks up, packed: a virtual texture.

An image is stored as *segments*, itself and its eighths: segment s serves levels of detail 3s to 3s + 3. Of a segment
only those blocks of 8 × 8 texels are stored that may be looked up. They keep together in charts, each with half a block
of its true surroundings, which is as far as filtering reaches up to level 3; charts interlock in one picture. All box
filters begin half a block before the image: texel i of an eighth covers texels 8i − 4 to 8i + 3.
"""

from dataclasses import dataclass
from itertools import accumulate, product

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, distance_transform_edt, find_objects, label

from depthwalk.bake.images import BakedObject, Cylinder, DepthImage, Face, texel_size
from depthwalk.bake.parallel import thread_map
from depthwalk.render.coverage import BLOCK, covered_blocks
from depthwalk.render.exposure import hardly_seen
from depthwalk.render.grids import Grids

MAX_SEGMENTS = 5  # of an image 8⁵ texels wide
LEVELS = 3  # of detail that a segment serves; a texel of the last is a block
DEPTH_PERIOD = 128.0  # texels, after which depths repeat
_LENGTHS = 8  # of normals that are tried
_WIDEST = 24  # blocks: wider pieces are cut into charts, which fit together better


@dataclass(frozen=True)
class Pages:
    """texels: (1 or 2, H, W, 4) uint8, level 0 of pictures. The first: (object normal + 1) / 2, see `encode_normals`,
    and the remainder of the depth, see `depth_code`. The second, unless all of it is `plain_colour`: √linear colour,
    specular strength. H and W are multiples of `BLOCK`.

    table: (images, rows, columns, 2) int16, for each block of each segment, right and up, what takes a texel to its
    place: a multiple of `BLOCK`, plus, to the right, the segment to look in: a coarser one where a block is not stored.
    first_rows: where each segment's blocks begin in it, `MAX_SEGMENTS` numbers; last_segment: the coarsest there is.
    """

    texels: NDArray[np.uint8]
    plain_colour: NDArray[np.uint8] | None
    table: NDArray[np.int16]
    first_rows: list[int]
    last_segment: int


@dataclass(frozen=True)
class _Segment:
    """texels: (h, w, 8) uint8; period: columns after which it repeats, 0 where it does not."""

    texels: NDArray[np.uint8]
    period: int


@dataclass(frozen=True)
class _Chart:
    """Blocks of one segment that move together. corner: row and column of the first; blocks: (h, w) bool."""

    image: int
    segment: int
    corner: tuple[int, int]
    blocks: NDArray[np.bool_]

    @property
    def cells(self) -> NDArray[np.bool_]:
        """What is stored for it, (h + 1, w + 1) blocks that begin half a block before it."""
        padded = np.pad(self.blocks, 1)
        return padded[1:, 1:] | padded[:-1, 1:] | padded[1:, :-1] | padded[:-1, :-1]


def build_pages(baked: BakedObject, grids: Grids) -> Pages:
    """The pages of all images of `baked`, with what the triangles of `grids` look up."""
    images = [_segments(image_texels(baked.cylinder, image), image.face) for image in baked.images]
    shapes = [_block_shape(segment.texels) for segment in images[0]]
    charts = _charts(baked, grids, shapes)
    places, (height, width) = _pack([chart.cells for chart in charts])
    cells = np.zeros((height, width, BLOCK, BLOCK, 8), np.uint8)
    for chart, (row, column) in zip(charts, places, strict=True):
        stored = chart.cells
        there = cells[row : row + stored.shape[0], column : column + stored.shape[1]]
        there[stored] = _cells(images[chart.image][chart.segment], chart.corner, stored.shape)[stored]
    pictures = cells.reshape(height, width, BLOCK, BLOCK, 2, 4).transpose(4, 0, 2, 1, 3, 5)
    texels = pictures.reshape(2, height * BLOCK, width * BLOCK, 4)
    colour = images[0][0].texels[0, 0, 4:]
    plain = all((segments[0].texels[..., 4:] == colour).all() for segments in images)
    table = _table(charts, places, shapes, len(images))
    rows = [rows for rows, _ in shapes] + [0] * (MAX_SEGMENTS - len(shapes))
    first_rows = [0, *accumulate(rows[:-1])]
    return Pages(texels[:1] if plain else texels, colour if plain else None, table, first_rows, len(shapes) - 1)


def image_texels(cylinder: Cylinder, image: DepthImage) -> NDArray[np.uint8]:
    """Normals and colours (H, W, 8) of an image, as `Pages.texels` has them. An empty texel has those of the nearest
    used one, so that filtering meets no black, and the depth that is farthest off."""
    # Colours as square roots: 8 bits suffice, and moderngl offers no sRGB texture arrays.
    colour = np.sqrt(np.maximum(image.albedo[..., :3], 0))
    shown = np.round(np.clip(np.concatenate([colour, image.albedo[..., 3:]], -1), 0, 1) * 255).astype(np.uint8)
    solid = np.isfinite(image.depth)
    depth = np.where(solid, image.depth, 0) / max(texel_size(cylinder, image.face, image.depth.shape))
    normal = np.zeros_like(image.normal, np.uint8)
    normal[solid] = encode_normals(image.normal[solid])
    texels = np.concatenate([normal, depth_code(depth)[..., None], shown], -1)
    if not solid.all() and solid.any():
        rows, columns = distance_transform_edt(~solid, return_distances=False, return_indices=True)
        texels = texels[rows, columns]
        texels[~solid, 3] += 128  # half the period
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


def _segments(texels: NDArray[np.uint8], face: Face) -> list[_Segment]:
    """The image and its eighths, down to one of at most a block and what is beside it."""
    height, width = texels.shape[:2]
    segments = [_Segment(texels, width if face is Face.SIDE else 0)]
    levels = (max(height, width) - 1).bit_length()
    while len(segments) * LEVELS < levels:
        segments.append(_eighth(segments[-1]))
    return segments


def _eighth(segment: _Segment) -> _Segment:
    height, width = ((size + BLOCK // 2 - 1) // BLOCK + 1 for size in segment.texels.shape[:2])
    texels = _cells(segment, (0, 0), (height, width)).mean((2, 3), dtype=np.float32)
    return _Segment(np.round(texels).astype(np.uint8), segment.period // BLOCK)


def _cells(segment: _Segment, corner: tuple[int, int], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """(h, w) = `shape` blocks (h, w, 8, 8, 8) of texels, from half a block before block `corner` on. Beyond its edges a
    segment repeats or, where it has no period, its outermost texels do."""
    height, width = segment.texels.shape[:2]
    rows, columns = (
        BLOCK * first - BLOCK // 2 + np.arange(BLOCK * count) for first, count in zip(corner, shape, strict=True)
    )
    columns = columns % segment.period if segment.period else columns.clip(0, width - 1)
    found = segment.texels[rows.clip(0, height - 1)[:, None], columns]
    return found.reshape(shape[0], BLOCK, shape[1], BLOCK, -1).swapaxes(1, 2)


def _block_shape(texels: NDArray[np.uint8]) -> tuple[int, int]:
    """Rows and columns of blocks of a segment."""
    height, width = texels.shape[:2]
    return -(-height // BLOCK), -(-width // BLOCK)


def _charts(baked: BakedObject, grids: Grids, shapes: list[tuple[int, int]]) -> list[_Chart]:
    """All that is stored; shapes: of each segment, in blocks. The last is whole, so that nothing is ever missing."""
    charts: list[_Chart] = []
    # A pixel that covers 2^k texels is drawn by grids up to the k-th after the first, and looks up level k − 1. The
    # last before the next segment is drawn where this one has all but given way to that.
    levels = [(segment + 1) * LEVELS for segment in range(len(shapes))]
    with thread_map() as each:
        hidden = hardly_seen(baked, grids, each)
    for segment, blocks in enumerate(covered_blocks(baked, grids, levels)):
        if segment == 0 and len(shapes) > 1:
            blocks &= ~hidden
        for eighth in shapes[1 : segment + 1]:
            blocks = _covered_eighth(blocks, eighth)
        blocks |= segment == len(shapes) - 1
        widest = _WIDEST if segment == 0 else max(shapes[segment])
        for row, column in product(*(range(0, size, widest) for size in shapes[segment])):
            for image, part in enumerate(blocks[:, row : row + widest, column : column + widest]):
                # Eighths stay in one piece: a block that they stand in for may lie across two of theirs.
                pieces = label(part)[0] if segment == 0 else part.astype(np.int32)
                charts += _cut_out(image, segment, (row, column), pieces)
    return charts


def _covered_eighth(blocks: NDArray[np.bool_], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Those blocks (images, *shape) of the eighth that `blocks` (images, rows, columns) lie on."""
    covered = np.zeros((len(blocks), *shape), bool)
    image, row, column = blocks.nonzero()
    for rows, columns in product(_ends_in_eighth(row, shape[0]), _ends_in_eighth(column, shape[1])):
        covered[image, rows, columns] = True
    return covered


def _ends_in_eighth(block: NDArray[np.integer], count: int) -> NDArray[np.integer]:
    """The first and the last (2, n) of the eighth's `count` blocks on which each `block` (n,) lies: it is as wide as a
    texel there but begins in the middle of one."""
    return np.minimum((block + np.array([[0], [1]])) // BLOCK, count - 1)


def _cut_out(image: int, segment: int, corner: tuple[int, int], pieces: NDArray[np.int32]) -> list[_Chart]:
    """A chart for each piece (1, 2, …) of some blocks (h, w) from block `corner` on."""
    charts = []
    for number, (rows, columns) in enumerate(find_objects(pieces), start=1):
        first = corner[0] + rows.start, corner[1] + columns.start
        charts.append(_Chart(image, segment, first, pieces[rows, columns] == number))
    return charts


def _pack(masks: list[NDArray[np.bool_]]) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Row and column for each mask in one picture in which they do not overlap, and its height and width.

    High ones first, each goes to the lowest place where it fits: masks of any shape fill each other's bays.
    """
    width = max(int(np.sqrt(sum(mask.sum() for mask in masks))), *(mask.shape[1] for mask in masks))
    free = np.ones((sum(mask.shape[0] for mask in masks), width), bool)
    places = [(0, 0)] * len(masks)
    height = 0
    for number in sorted(range(len(masks)), key=lambda number: masks[number].shape, reverse=True):
        rows, columns = masks[number].shape
        fits = binary_erosion(free[: height + rows], masks[number])
        row, column = divmod(int(fits.argmax()), width)
        row, column = row - rows // 2, column - columns // 2  # from the mask's centre
        free[row : row + rows, column : column + columns] &= ~masks[number]
        places[number] = row, column
        height = max(height, row + rows)
    return places, (height, width)


def _table(
    charts: list[_Chart], places: list[tuple[int, int]], shapes: list[tuple[int, int]], images: int
) -> NDArray[np.int16]:
    """`Pages.table`; shapes: rows and columns of blocks in each segment."""
    grids = [np.zeros((images, *shape, 2), np.int16) for shape in shapes]
    stored = [np.zeros((images, *shape), bool) for shape in shapes]
    for chart, (row, column) in zip(charts, places, strict=True):
        (first, left), (rows, columns) = chart.corner, chart.blocks.shape
        at = chart.image, slice(first, first + rows), slice(left, left + columns)
        stored[chart.segment][at] |= chart.blocks
        grids[chart.segment][at][chart.blocks] = BLOCK * (column - left) + chart.segment, BLOCK * (row - first)
    for finer in range(len(shapes) - 2, -1, -1):
        ends = [
            _ends_in_eighth(np.arange(size), end) for size, end in zip(shapes[finer], shapes[finer + 1], strict=True)
        ]
        choices = [grids[finer + 1][:, rows[:, None], columns] for rows, columns in product(*ends)]
        alike = np.all([choice == choices[0] for choice in choices], axis=(0, -1))[..., None]
        fallback = np.where(alike, choices[0], grids[-1][:, :1, :1])
        grids[finer] = np.where(stored[finer][..., None], grids[finer], fallback)
    widest = shapes[0][1]
    return np.concatenate([np.pad(grid, ((0, 0), (0, 0), (0, widest - grid.shape[2]), (0, 0))) for grid in grids], 1)

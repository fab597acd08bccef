"""Every demo file by name, with what it is."""

from collections.abc import Callable
from dataclasses import dataclass

from tools.make_models import heads, plants, props, statue, stone, textures
from tools.make_models.model import Model


@dataclass(frozen=True)
class Entry:
    """closed: every edge of the mesh joins two faces; flat-sided props repeat the corners of their sides instead."""

    make: Callable[[], Model]
    about: str
    closed: bool = False


MODELS: dict[str, Entry] = {
    "head_venus": Entry(heads.head_venus, "bust of a woman, marble; the paper's count for its Venus", closed=True),
    "head_man": Entry(
        heads.head_man, "bust of a bearded man, bronze, one face open below; the paper's count for its man's head"
    ),
    "statue": Entry(statue.statue, "draped woman with a bowl, limestone", closed=True),
    "tree_oak": Entry(plants.oak, "broad-leaved tree", closed=True),
    "tree_fir": Entry(plants.fir, "conifer", closed=True),
    "topiary": Entry(plants.topiary, "two clipped balls in a terracotta pot", closed=True),
    "rock_boulder": Entry(stone.boulder, "mossy boulder", closed=True),
    "rock_slab": Entry(stone.slab_rock, "low mossy rock", closed=True),
    "urn": Entry(stone.urn, "garden urn with garland and two handles", closed=True),
    "column": Entry(stone.column, "fluted column with leafy capital and ivy"),
    "fountain": Entry(stone.fountain, "round basin with two lobed bowls and water", closed=True),
    "sundial": Entry(stone.sundial, "sundial on a baluster"),
    "teapot": Entry(props.teapot, "blue and white pot with lid, handle and spout", closed=True),
    "path_tile": Entry(props.path_tile, "2 m of flagged path along z"),
    "bench": Entry(props.bench, "garden bench, faces +z"),
    "hedge": Entry(props.hedge, "2 m of clipped hedge along x"),
    "wall": Entry(props.wall, "2 m of low brick wall along x"),
    "table": Entry(props.table, "wooden table"),
    "pedestal": Entry(props.pedestal, "square plinth for a bust"),
    "room": Entry(props.room, "room seen from inside, window in the wall at −z"),
}

TEXTURES: dict[str, tuple[Callable[[], textures.Picture], str]] = {
    "grass": (textures.grass, "lawn from above, seamless, for about 1.5 m"),
    "paving": (textures.paving, "flagstones, seamless, for about 2 m"),
    "bark_height": (textures.bark, "depth image of oak bark, white in front, seamless, for about 0.3 × 0.4 m"),
}

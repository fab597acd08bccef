"""List every demo file by name, with the function that makes it and how it ships."""

from collections.abc import Callable
from dataclasses import dataclass

from tools.make_models import heads, plants, props, statue, stone, textures
from tools.make_models.model import Model


@dataclass(frozen=True)
class Images:
    """Say how a model is baked and cooked.

    Attributes
    ----------
    resolution
        Width and height of a depth image, texels.
    layers
        Surfaces sampled along each ray.
    finest
        The error that the finest level of detail may have, texels. Finer levels would be two thirds of a file, and are
        seen only where texels are large on the screen.
    """

    resolution: int
    layers: int = 2
    finest: float = 0.4


@dataclass(frozen=True)
class Entry:
    """Describe a demo model, and how it ships.

    Attributes
    ----------
    make
        The function that makes the model.
    about
        What the model is, for SOURCES.md.
    images
        How its depth images are baked; None for a model that ships as its mesh.
    closed
        Whether every edge of the mesh joins two faces. Of the others, some are made of parts that stand in each other,
        and flat-sided props repeat the corners of their sides.
    """

    make: Callable[[], Model]
    about: str
    images: Images | None = None
    closed: bool = False


MODELS: dict[str, Entry] = {
    "head_venus": Entry(heads.head_venus, "bust of a woman, rasped marble", Images(272, 3, 0.5), closed=True),
    "head_man": Entry(heads.head_man, "bust of a bearded man, cast bronze", Images(256, 3, 0.45), closed=True),
    "statue": Entry(statue.statue, "draped woman with a bowl, chiselled limestone", Images(320, 2, 0.75), closed=True),
    "tree_oak": Entry(plants.oak, "broad-leaved tree, 19,000 lobed leaves", Images(176, 2, 1.0), closed=True),
    "tree_fir": Entry(plants.fir, "conifer, 5,700 twigs of 91 needles", Images(144, 2, 1.0), closed=True),
    "topiary": Entry(plants.topiary, "two clipped balls of box in a terracotta pot", Images(134, 2, 1.25), closed=True),
    "rock_boulder": Entry(stone.boulder, "mossy boulder", Images(144, 2, 0.65), closed=True),
    "rock_slab": Entry(stone.slab_rock, "low mossy rock", Images(144, 2, 0.55), closed=True),
    "urn": Entry(stone.urn, "garden urn with garland and two handles", Images(192, 3, 0.35), closed=True),
    "column": Entry(stone.column, "fluted column with leafy capital and ivy", Images(192, 2, 0.87)),
    "fountain": Entry(stone.fountain, "round basin with two lobed bowls and water", Images(272, 5, 0.5), closed=True),
    "sundial": Entry(stone.sundial, "sundial on a baluster", Images(144)),
    "path_tile": Entry(props.path_tile, "2 m of flagged path along z", Images(192, 1, 2.0), closed=True),
    "bench": Entry(props.bench, "garden bench, faces +z", Images(232, 5, 0.6), closed=True),
    "hedge": Entry(props.hedge, "2 m of clipped hedge along x", Images(160, 1, 1.13), closed=True),
    "wall": Entry(props.wall, "2 m of low brick wall along x", Images(160, 1), closed=True),
    "pedestal": Entry(props.pedestal, "square plinth for a bust", Images(164, 5, 0.5), closed=True),
    "dryad": Entry(statue.dryad, "the statue, smooth and light, for the relief of meso.yaml", closed=True),
    "venus_of_the_paper": Entry(heads.venus_of_the_paper, "the woman's bust with the paper's count", closed=True),
    "man_of_the_paper": Entry(heads.man_of_the_paper, "the man's bust with the paper's count, one face open below"),
    "teapot": Entry(props.teapot, "blue and white pot with lid, handle and spout", closed=True),
    "table": Entry(props.table, "wooden table"),
    "room": Entry(props.room, "room seen from inside, window in the wall at −z"),
}

TEXTURES: dict[str, tuple[Callable[[], textures.Picture], str]] = {
    "grass": (textures.grass, "lawn from above, seamless, for about 1.5 m"),
    "paving": (textures.paving, "flagstones, seamless, for about 2 m"),
    "bark_height": (textures.bark, "depth image of oak bark, white in front, seamless, for about 0.3 × 0.4 m"),
}

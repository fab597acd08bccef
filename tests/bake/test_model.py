"""A baked asset: the objects that together show one mesh."""

from dataclasses import replace

from depthwalk.bake.model import BakedModel
from shapes import bake, box


def test_a_model_has_the_key_of_its_objects() -> None:
    one = replace(bake(box(1.0, 1.0, 1.0), 16, 1), key="abc")
    model = BakedModel(parts=(one, replace(one, position=(1.0, 0.0, 0.0))))
    assert model.key == "abc" and {part.key for part in model.parts} == {model.key}

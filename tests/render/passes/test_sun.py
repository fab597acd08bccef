"""What part of the sun's light reaches a surface: none below what is above it, all beside it."""

import numpy as np

from alone import MakeAlone
from depthwalk.render.passes.sun import SunPass
from depthwalk.scene.arrays import Representation
from shapes import ShapeLibrary, box, scene_of
from stage import Stage, view_of
from studio import Studio


def test_a_plate_shadows_the_ground_below_it(studio: Studio) -> None:
    library = ShapeLibrary([box(1.0, 0.1, 1.0, (0, 1.0, 0))], [None])
    environment = {"ground": {"height": 0.0}, "sun": {"direction": (0, -1, 0)}}
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH, **environment)
    with Stage(studio, scene, library) as stage:
        stage.draw(view_of((0.0, 0.6, 4.0), (0.0, 0.2, 0.0)))
        point, share = stage.points(), stage.share()
    ground = np.abs(point[..., 1]) < 0.01
    aside = np.abs(point[..., [0, 2]]).max(-1)
    below, beside = ground & (aside < 0.4), ground & (aside > 0.6) & (aside < 2)
    assert below.sum() > 100 and beside.sum() > 100
    assert (share[below] == 0).all() and (share[beside] == 1).all()


def test_without_maps_there_is_nothing_to_look_up(alone: MakeAlone) -> None:
    sun = alone(SunPass())
    assert not sun.pass_.enabled(sun.frame(), sun.pass_.params)

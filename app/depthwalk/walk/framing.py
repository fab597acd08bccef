"""Choose cameras that show all objects of a scene, from the bounds of the objects."""

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.ingest.formats import is_model_file
from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene

_EMPTY = 10.0  # metres: radius assumed for an empty scene


def home_in(scene: Scene, renderer: Renderer, aspect: float) -> Camera:
    """Return the first camera of a scene: its own, or one that shows all objects.

    Parameters
    ----------
    scene
        The scene.
    renderer
        The renderer that draws it.
    aspect
        Width / height of the window.

    Returns
    -------
    Camera
        The camera, world; of a single model also while it turns.
    """
    return scene.camera or renderer.frame_all(aspect, turns=is_model_file(scene.path))


def extent_in(renderer: Renderer) -> tuple[NDArray[np.float64], float]:
    """Return the centre (3,), metres, world, and the radius, metres, of a sphere that holds all objects."""
    bounds = renderer.world.bounds()
    return bounds.sphere() if len(bounds.bounding_radius) else (np.zeros(3), _EMPTY)


def distance_to_all(renderer: Renderer, camera: Camera) -> float:
    """Return the distance along the view axis to the centre of all objects; their radius if that is behind."""
    centre, radius = extent_in(renderer)
    ahead = glm.dot(glm.dvec3(centre) - glm.dvec3(*camera.position), glm.normalize(camera.look))
    return ahead if ahead > 0 else radius

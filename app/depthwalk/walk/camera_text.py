"""Write a camera as text: for a scene file, or as options of the command line."""

import math

from depthwalk.scene.arrays import Camera
from depthwalk.walk.orbit import distance

_PRECISION = 4  # decimal places of a coordinate for a target 1 m away: changes the direction by 0.01 degrees at most


def camera_yaml(camera: Camera) -> str:
    """Return a camera as the line `camera: {…}` of a scene file.

    Parameters
    ----------
    camera
        The camera. Its coordinates are rounded to 1/10,000 of the distance to its target, at least to millimetres.

    Returns
    -------
    str
        One line: position and target in metres, fov in degrees.
    """
    places = max(3, _PRECISION - math.floor(math.log10(distance(camera))))
    position, target = (
        ", ".join(f"{round(value, places) + 0.0:.12g}" for value in point)  # + 0.0: no −0
        for point in (camera.position, camera.target)
    )
    return f"camera: {{position: [{position}], target: [{target}], fov: {math.degrees(camera.fov):.6g}}}"


def camera_options(camera: Camera) -> str:
    """Return a camera as options of `depthwalk render` and, in a scene without animations, of `depthwalk view`."""
    place, target = (",".join(f"{value:.6g}" for value in point) for point in (camera.position, camera.target))
    fov, time = math.degrees(camera.fov), f" --time {camera.time:.6g}" if camera.time else ""
    return f"--camera-position {place} --camera-target {target} --camera-view-angle {fov:.6g}{time}"

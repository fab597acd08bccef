"""Measure ambient occlusion against rays: `python -m tools.ambient_occlusion SCENE` prints rows for docs/light.md.

From the surface in every fourth pixel of every fourth row, rays go to all sides, as many as a cosine weighs them. What
they hit takes away light by its distance, as in shaders/ambient_occlusion. Their mean is the truth that the target
`ambient_visibility` is compared with, along with the assumption that all light arrives. Only objects with meshes count.
"""

import argparse
import statistics
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.raycast import RayCaster
from depthwalk.errors import InputError
from depthwalk.geometry.quaternions import rotate
from depthwalk.geometry.vectors import lengths
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.reference.gbuffer import unpacked_surfaces
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.field_of_view import spread_rays
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene
from depthwalk.types import Array, Mask

_EVERY = 4  # pixels
_RAYS = 256  # from each of them
_LIFT = 1e-3  # part of the distance to the viewer by which rays start above a surface
_FRAMES = 15  # of each setting that are timed


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a row for meshes and one for depth images: errors without and with ambient occlusion, and its cost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--size", type=int, nargs=2, default=(1024, 768), help="of the pictures, pixels")
    parser.add_argument("--radius", type=float, help="metres")
    args = parser.parse_args(arguments)
    try:
        scene = load_scene(args.scene)
    except InputError as error:
        parser.error(str(error))
    scene.render.aa = "none"
    params = scene.render.ambient_occlusion
    params.radius = params.radius if args.radius is None else args.radius
    library, size = SceneLibrary(scene.assets), (args.size[0], args.size[1])
    caster = RayCaster(_joined(scene, library), two_sided=True)
    print(
        "| drawn as | all light, RMS off | this, RMS off | this, mean off | frame, × without |\n|---|---|---|---|---|"
    )
    for kind in (Representation.MESH, Representation.DPCI):
        with HeadlessRenderer(scene, library, size, kind) as headless:
            view = View(scene.camera or headless.frame_all(), size)
            ratio = _cost(headless, view)
            point, normal, found, present = _drawn(headless, view)
        truth = _truth(caster, point[present], normal[present], params.radius)
        plain, off = 1 - truth, found[present] - truth
        errors = np.sqrt(np.mean(plain**2)), np.sqrt(np.mean(off**2)), np.mean(off)
        print(
            f"| {kind.name.lower()} | " + " | ".join(f"{error:.3f}" for error in errors) + f" | {ratio:.2f} |",
            flush=True,
        )


def _joined(scene: Scene, library: SceneLibrary) -> Mesh:
    """Return all objects that have meshes as one mesh, world, with nothing but its geometry."""
    positions, faces, count = [], [], 0
    objects = scene.objects
    for asset, position, rotation, scale in zip(
        objects.asset, objects.position, objects.rotation, objects.scale, strict=True
    ):
        mesh = library.mesh(int(asset))
        if mesh is not None:
            positions.append(position + scale * rotate(rotation, mesh.positions))
            faces.append(mesh.faces + np.int32(count))
            count += len(mesh.positions)
    points, triangles = np.concatenate(positions).astype(np.float32), np.concatenate(faces)
    part = Part(first_face=0, face_count=len(triangles), material=0)
    return Mesh(
        positions=points,
        normals=np.zeros_like(points),
        colours=np.full(points.shape, 255, np.uint8),
        uv=np.zeros((len(points), 2), np.float32),
        faces=triangles,
        parts=(part,),
        materials=(Material(),),
    )


def _cost(headless: HeadlessRenderer, view: View) -> float:
    """Return the processor time of a frame with ambient occlusion over that of one without; the settings stay on."""
    params = headless.renderer.settings.ambient_occlusion
    times: dict[bool, list[float]] = {True: [], False: []}
    for _ in range(_FRAMES):
        for params.enabled in (False, True):
            start = time.process_time()
            headless.draw(view)
            headless.finish()
            times[params.enabled].append(time.process_time() - start)
    return statistics.median(with_it / without for with_it, without in zip(times[True], times[False], strict=True))


def _drawn(headless: HeadlessRenderer, view: View) -> tuple[Array, Array, Array, Mask]:
    """Return points and normals (h, w, 3), world, their visibility (h, w), and where there is a surface, (h, w)."""
    targets, fitted = headless.renderer.targets, headless.renderer.view
    assert targets is not None and fitted is not None and targets.ambient_visibility is not None
    width, height = view.size
    with headless.device.context:
        depth = np.frombuffer(targets.depth.read(alignment=1), np.float32).reshape(height, width)
        surface = np.frombuffer(targets.surface.read(alignment=1), np.uint32).reshape(-1, 2)
        texture = targets.ambient_visibility.texture
        found = np.frombuffer(texture.read(alignment=1), np.float32).reshape(texture.height, texture.width, 2)
    normal = unpacked_surfaces(surface).normal.reshape(height, width, 3)
    rays = spread_rays(view, width, height).reshape(height, width, 3)
    distance = np.where(depth < 1, view_distance(depth, *fitted.depth_range), 0)
    point = view.position + rays * distance[..., None]
    some = slice(None, None, _EVERY), slice(None, None, _EVERY)
    return point[some], normal[some], found[:: _EVERY // 2, :: _EVERY // 2, 0], depth[some] < 1


def _truth(caster: RayCaster, point: Array, normal: Array, radius: float) -> Array:
    """Return the part (n,) of the ambient light that reaches points (n, 3) with normals (n, 3)."""
    random = np.random.default_rng(0)
    light = np.zeros(len(point))
    start = point + _LIFT * normal
    for _ in range(_RAYS):
        sphere = random.normal(size=point.shape)
        direction = normal + 0.999 * sphere / lengths(sphere)[:, None]  # weighted by the cosine
        direction /= lengths(direction)[:, None]
        light += 1 - np.clip(2 - 2 * caster.first(start, direction).distance / radius, 0, 1)
    return light / _RAYS


if __name__ == "__main__":
    main()

"""Say what a scene's camera sees, and how far off: python examples/depth_and_ids.py scene.yaml [WIDTH HEIGHT]."""

import argparse

import numpy as np

import depthwalk as dw


def main(scene_file: str, width: int, height: int) -> None:
    """Print for every object in the picture its node, how many pixels it covers and where it is nearest."""
    scene = dw.load_scene(scene_file)
    with dw.Renderer(scene, size=(width, height)) as renderer:
        image = renderer.render(object_id=True)
    for object_id in np.unique(image.object_id[image.object_id >= 0]).tolist():
        pixels = image.object_id == object_id
        node = scene.node_of(object_id)
        name = scene.nodes[node] or f"node {node}"
        print(f"object {object_id} of {name}: {pixels.sum()} pixels, from {image.depth[pixels].min():.2f} m")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene_file")
    parser.add_argument("width", nargs="?", type=int, default=640)
    parser.add_argument("height", nargs="?", type=int, default=480)
    main(**vars(parser.parse_args()))

"""Walk around a scene in a video: python examples/video.py scene.yaml round.mp4 [COUNT [WIDTH HEIGHT]]."""

import argparse
import math

import imageio_ffmpeg  # comes with depthwalk, with an encoder

import depthwalk as dw


def main(scene_file: str, video: str, count: int, width: int, height: int) -> None:
    """Draw smooth pictures from cameras on a circle around all objects; the sides of a video are even numbers."""
    scene = dw.load_scene(scene_file, overrides={"render.aa": "ssaa"})
    size = width, height
    with dw.Renderer(scene, size, reuse=True) as renderer:
        first = renderer.frame_all()
        (x, y, z), (from_x, _, from_z) = first.target, first.position
        radius = 1.5 * math.hypot(from_x - x, from_z - z)  # from the side, objects may be nearer
        frames = imageio_ffmpeg.write_frames(video, size, fps=30, macro_block_size=2)
        frames.send(None)
        for frame in range(count):
            turn = 2 * math.pi * frame / count
            position = x + radius * math.sin(turn), first.position[1], z + radius * math.cos(turn)
            image = renderer.render(dw.Camera(position, (x, y, z), first.fov))
            frames.send(image.rgba[..., :3].tobytes())
        frames.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene_file")
    parser.add_argument("video")
    parser.add_argument("count", nargs="?", type=int, default=120)
    parser.add_argument("width", nargs="?", type=int, default=640)
    parser.add_argument("height", nargs="?", type=int, default=480)
    main(**vars(parser.parse_args()))

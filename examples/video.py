"""Walk around a scene in a video: python examples/video.py scene.yaml round.mp4 [COUNT [WIDTH HEIGHT]]."""

import math
import sys

import imageio_ffmpeg  # comes with depthwalk, with an encoder

import depthwalk as dw


def main(scene_file: str, video: str, count: str = "120", width: str = "640", height: str = "480") -> None:
    """Draw smooth pictures from cameras on a circle around all objects; the sides of a video are even numbers."""
    scene = dw.load_scene(scene_file, overrides={"render.aa": "ssaa"})
    size = int(width), int(height)
    with dw.Renderer(scene, size, reuse=True) as renderer:
        first = renderer.frame_all()
        (x, y, z), (from_x, _, from_z) = first.target, first.position
        radius = 1.5 * math.hypot(from_x - x, from_z - z)  # from the side, objects may be nearer
        frames = imageio_ffmpeg.write_frames(video, size, fps=30, macro_block_size=2)
        frames.send(None)
        for frame in range(int(count)):
            turn = 2 * math.pi * frame / int(count)
            position = x + radius * math.sin(turn), first.position[1], z + radius * math.cos(turn)
            image = renderer.render(dw.Camera(position, (x, y, z), first.fov))
            frames.send(image.rgba[..., :3].tobytes())
        frames.close()


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 2 else sys.exit(__doc__)

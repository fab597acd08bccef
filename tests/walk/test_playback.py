import numpy as np
import pytest

from depthwalk.scene.path import CameraPath
from depthwalk.walk.playback import Playback


def playback(times: tuple[float, ...] = (0.0, 1.0, 4.0), **options: bool) -> Playback:
    views = np.array([(t, 0, 0, t, 0, -1) for t in times], float)
    return Playback(
        CameraPath(fps=30.0, interpolation="smooth", times=np.array(times), views=views, fovs=np.ones(len(times))),
        **options,
    )


def test_it_plays_to_the_end_and_starts_again() -> None:
    play = playback()
    play.advance(1.0)
    assert play.time == 0.0
    play.toggle()
    play.advance(1.5)
    assert play.time == 1.5 and play.camera.position[0] == pytest.approx(1.5)
    play.advance(100.0)
    assert play.time == play.duration == 4.0 and not play.playing
    play.toggle()
    assert play.playing and play.time == 0.0


def test_it_loops() -> None:
    play = playback(loop=True, playing=True)
    play.advance(9.0)
    assert play.time == pytest.approx(1.0) and play.playing


@pytest.mark.parametrize("loop", [False, True])
def test_a_path_of_one_keyframe_stops(loop: bool) -> None:
    play = playback(times=(0.0,), loop=loop, playing=True)
    play.advance(0.1)
    assert play.time == 0.0 and not play.playing

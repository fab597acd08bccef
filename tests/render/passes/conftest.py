from collections.abc import Iterator
from typing import Any

import pytest

from alone import VIEW, Alone, MakeAlone
from depthwalk.gpu.device import Device
from depthwalk.render.frame import Pass
from depthwalk.render.view.view import View


@pytest.fixture
def alone(gl_device: Device) -> Iterator[MakeAlone]:
    """Makes `Alone`s of passes, and releases them."""
    made: list[Alone] = []

    def make(pass_: Pass[Any], view: View = VIEW, samples: int = 1) -> Alone:
        made.append(Alone(gl_device, pass_, view, samples))
        return made[-1]

    yield make
    for each in made:
        each.release()

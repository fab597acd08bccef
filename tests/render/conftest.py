import pytest

from depthwalk.gpu.device import Device
from studio import Studio


@pytest.fixture(scope="session")
def studio(gl_device: Device) -> Studio:
    return Studio(gl_device)

"""The names of settings that tests are run with."""

from typing import Literal

AaName = Literal["none", "coverage", "msaa", "fxaa", "smaa", "gpaa", "gpaa-edge", "ssaa"]

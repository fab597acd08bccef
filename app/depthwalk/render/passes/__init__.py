"""The passes of a frame, in order. Adding one: a module here, a folder in shaders/, a line in `PASSES`."""

from depthwalk.render.frame import Pass
from depthwalk.render.passes.composite import CompositePass
from depthwalk.render.passes.coverage import CoveragePass
from depthwalk.render.passes.dmesh import DmeshPass
from depthwalk.render.passes.dof import DofPass
from depthwalk.render.passes.fog import FogPass
from depthwalk.render.passes.fxaa import FxaaPass
from depthwalk.render.passes.gpaa import GpaaPass
from depthwalk.render.passes.ground import GroundPass
from depthwalk.render.passes.light import LightPass
from depthwalk.render.passes.mesh import MeshPass
from depthwalk.render.passes.output import OutputPass
from depthwalk.render.passes.resolve import ResolvePass
from depthwalk.render.passes.sample import SamplePass
from depthwalk.render.passes.shade import ShadePass
from depthwalk.render.passes.shadows import ShadowsPass
from depthwalk.render.passes.smaa import SmaaPass
from depthwalk.render.passes.sun import SunPass
from depthwalk.render.passes.warp import WarpPass

PASSES: tuple[type[Pass], ...] = (
    WarpPass,
    CompositePass,
    DmeshPass,
    MeshPass,
    GroundPass,
    ShadowsPass,
    SamplePass,
    ShadePass,
    SunPass,
    LightPass,
    FogPass,
    ResolvePass,
    CoveragePass,
    GpaaPass,
    FxaaPass,
    SmaaPass,
    DofPass,
    OutputPass,
)

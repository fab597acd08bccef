"""List the passes of a frame, in their order: one module each, with its shaders in shaders/NAME/.

A new pass in the package needs a module here, a folder in shaders/, a line in `PASSES`, and its parameters, if any, in
`scene/object_settings.py` or `scene/effect_settings.py`; new targets are declared in `render/target_table.py`. A pass
outside the package is handed to `depthwalk.Renderer(…, passes=…)`, as in examples/own_pass.py. `render.frame.Pass`
documents what a pass must declare and what it may rely on.
"""

from typing import Any

from depthwalk.render.frame import Pass
from depthwalk.render.passes.ambient_occlusion import AmbientOcclusionPass
from depthwalk.render.passes.bar_texture import BarTexturePass
from depthwalk.render.passes.billboard import BillboardPass
from depthwalk.render.passes.bump import BumpPass
from depthwalk.render.passes.composite import CompositePass
from depthwalk.render.passes.coverage import CoveragePass
from depthwalk.render.passes.displacement import DisplacementPass
from depthwalk.render.passes.distance import DistancePass
from depthwalk.render.passes.dmesh import DmeshPass
from depthwalk.render.passes.dof import DofPass
from depthwalk.render.passes.fog import FogPass
from depthwalk.render.passes.fxaa import FxaaPass
from depthwalk.render.passes.gpaa import GpaaPass
from depthwalk.render.passes.ground import GroundPass
from depthwalk.render.passes.inspection import InspectionPass
from depthwalk.render.passes.light import LightPass
from depthwalk.render.passes.material_resolve import MaterialResolvePass
from depthwalk.render.passes.mesh import MeshPass
from depthwalk.render.passes.octahedral import OctahedralPass
from depthwalk.render.passes.output import OutputPass
from depthwalk.render.passes.parallax import ParallaxPass
from depthwalk.render.passes.relief import ReliefPass
from depthwalk.render.passes.relief_texture import ReliefTexturePass
from depthwalk.render.passes.resolve import ResolvePass
from depthwalk.render.passes.sample import SamplePass
from depthwalk.render.passes.shadows import ShadowsPass
from depthwalk.render.passes.smaa import SmaaPass
from depthwalk.render.passes.sun import SunPass
from depthwalk.render.passes.translucency import TranslucencyPass
from depthwalk.render.passes.warp import WarpPass

PASSES: tuple[type[Pass[Any]], ...] = (
    # Objects, once for each occlusion phase: meshes to the G-buffer, depth images to the visibility buffer. Meshes come
    # first, while nothing else is in the visibility buffer.
    MeshPass,
    WarpPass,
    CompositePass,
    DmeshPass,
    ReliefPass,
    DistancePass,
    ParallaxPass,
    BumpPass,
    DisplacementPass,
    ReliefTexturePass,
    BarTexturePass,
    OctahedralPass,
    BillboardPass,
    # Ground, shadow maps, and the colours and normals of depth images: everything that lighting needs.
    GroundPass,
    ShadowsPass,
    SamplePass,
    MaterialResolvePass,
    # Light, in linear colours.
    AmbientOcclusionPass,
    SunPass,
    LightPass,
    FogPass,
    InspectionPass,
    ResolvePass,
    TranslucencyPass,
    # Anti-aliasing, depth of field, and the finished picture.
    CoveragePass,
    GpaaPass,
    FxaaPass,
    SmaaPass,
    DofPass,
    OutputPass,
)


def default_passes() -> list[Pass[Any]]:
    """Return new passes of the package, in the order of a frame, for one renderer; others may be inserted."""
    return [pass_class() for pass_class in PASSES]

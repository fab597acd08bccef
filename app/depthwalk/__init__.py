"""Walk through scenes too heavy to draw, by means of depth images that are warped on the GPU.

The names in `__all__` are the public interface of the library; docs/api.md has an example of each. Everything else may
change from one release to the next. A name is imported when it is first used, so that `import depthwalk` is cheap and
reading a scene loads no graphics library.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from depthwalk.api.mesh import Comparison, bake_mesh, compare
    from depthwalk.api.renderer import Image, Renderer
    from depthwalk.api.scene import Scene, load_scene
    from depthwalk.api.window import view
    from depthwalk.errors import InputError
    from depthwalk.gpu.failures import GpuError
    from depthwalk.gpu.program import Program
    from depthwalk.params import Params
    from depthwalk.render.frame import Pass
    from depthwalk.render.passes import default_passes
    from depthwalk.scene.arrays import Camera

__version__ = "0.1.0"

_MODULES = {
    "Camera": "depthwalk.scene.arrays",
    "Comparison": "depthwalk.api.mesh",
    "GpuError": "depthwalk.gpu.failures",
    "Image": "depthwalk.api.renderer",
    "InputError": "depthwalk.errors",
    "Params": "depthwalk.params",
    "Pass": "depthwalk.render.frame",
    "Program": "depthwalk.gpu.program",
    "Renderer": "depthwalk.api.renderer",
    "Scene": "depthwalk.api.scene",
    "bake_mesh": "depthwalk.api.mesh",
    "compare": "depthwalk.api.mesh",
    "default_passes": "depthwalk.render.passes",
    "load_scene": "depthwalk.api.scene",
    "view": "depthwalk.api.window",
}

__all__ = [
    "Camera",
    "Comparison",
    "GpuError",
    "Image",
    "InputError",
    "Params",
    "Pass",
    "Program",
    "Renderer",
    "Scene",
    "bake_mesh",
    "compare",
    "default_passes",
    "load_scene",
    "view",
]


def __getattr__(name: str) -> object:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_MODULES[name]), name)
    return value


def __dir__() -> list[str]:
    """List the public names too, even before they have been imported."""
    return sorted({*globals(), *__all__})

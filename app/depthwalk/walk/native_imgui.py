"""Import imgui from imgui-bundle's native module, without the bundle's other libraries; see `bundle`."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from types import ModuleType
from typing import TYPE_CHECKING

from depthwalk.walk.bundle import FOLDER

_NAME = "imgui_bundle._imgui_bundle"


def _native() -> ModuleType:
    """Return the native module, loaded under its own name, so that later imports of imgui-bundle share it."""
    if _NAME not in sys.modules:
        file = next(file for file in FOLDER.glob("_imgui_bundle.*") if file.suffix in (".so", ".pyd"))
        spec = spec_from_file_location(_NAME, file)
        assert spec is not None and spec.loader is not None
        sys.modules[_NAME] = module = module_from_spec(spec)
        spec.loader.exec_module(module)
    return sys.modules[_NAME]


if TYPE_CHECKING:
    from imgui_bundle import imgui as imgui
else:
    imgui = _native().imgui

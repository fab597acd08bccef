"""A mesh is baked alike by a scene file, by a command and from Python, where nobody says how."""

import inspect

import depthwalk as dw
from depthwalk.assets.asset_files import model_params
from depthwalk.bake.params import ModelParams
from depthwalk.commands.bake import main
from depthwalk.scene.schema import DpciParams

NAMES = "resolution", "layers", "method", "parts", "axis", "coordinates"
EXPECTED = {name: getattr(ModelParams(), name) for name in NAMES}


def test_scene_files() -> None:
    assert model_params(DpciParams()) == ModelParams()


def test_python() -> None:
    parameters = inspect.signature(dw.bake_mesh).parameters
    assert {name: parameters[name].default for name in NAMES} == EXPECTED


def test_commands() -> None:
    """What an option leaves open, None, is left to `ModelParams`."""
    parameters = inspect.signature(main).parameters
    assert (parameters["dpci_resolution"].default, parameters["method"].default.value) == (
        EXPECTED["resolution"],
        EXPECTED["method"],
    )
    assert {parameters[name].default for name in ("layers", "parts", "axis", "coordinates")} == {None}

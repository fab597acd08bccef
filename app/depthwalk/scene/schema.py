"""Declare the scene file, version 1: its keys, with defaults, units, ranges and help.

Angles are degrees, lengths metres, colours sRGB, as in the file. pydantic checks files against these classes, and the
JSON schema for editors and docs/scene-file.md are generated from them. The rest is declared in `asset_schema`,
`node_schema`, `environment` and `render_settings`.
"""

from typing import Annotated

from pydantic import Field

from depthwalk.limits import MAX_ASSETS
from depthwalk.params import param
from depthwalk.scene.asset_schema import AssetParams
from depthwalk.scene.environment import CameraParams, Environment, WalkParams
from depthwalk.scene.fields import FileParams, FilePath, Version
from depthwalk.scene.node_schema import ItemParams
from depthwalk.scene.render_settings import RenderSettings


class SceneFile(FileParams):
    """Describe a scene file as it is written."""

    version: Version = param(..., "Version of the file format")
    assets: Annotated[dict[str, AssetParams], Field(max_length=MAX_ASSETS)] = Field({}, description="Models, by name")
    objects: list[ItemParams] = Field(
        [], description="Nodes of the scene graph: objects, groups and other sets of objects"
    )
    environment: Environment = Field(default_factory=Environment, description="Sky, ground and lights")
    camera: CameraParams | None = param(None, "Camera at the start; if left out, one that shows all objects")
    walk: WalkParams = Field(default_factory=WalkParams, description="Walking in the window")
    advice: FilePath | None = param(None, "File written by `depthwalk advise`, which `representation: auto` follows")
    render: RenderSettings = Field(default_factory=RenderSettings, description="Render settings")

"""Express cameras and lights of USD by those of glTF.

UsdLux gives the radiance of a light's surface, L = intensity · 2^exposure; `normalize` divides it by the light's area.
glTF has the illuminance of a distant light, L · π · sin²(angle / 2), and the intensity of a small one, L · π · r².
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, UsdGeom, UsdLux

from depthwalk.ingest.gltf_lights import LIGHTS
from depthwalk.ingest.usd.glb import GlbBuilder, Header
from depthwalk.ingest.usd.nodes import Nodes
from depthwalk.ingest.usd.pictures import Pictures
from depthwalk.ingest.usd.problems import Unread

_Matrix = NDArray[np.float64]  # (4, 4), stage from prim

SKY = "sky"
"""Key of the header's `extras` for the dome light: `picture`, the bufferView of its file, with `suffix`, the ending of
its name; `turn`, degrees about +y, and `intensity`."""


class Stands:
    """Write cameras and lights into a file."""

    def __init__(self, builder: GlbBuilder, nodes: Nodes, pictures: Pictures, time: Any, unread: Unread) -> None:
        """Prepare to write into a file what cameras and lights are at a time."""
        self._builder, self._nodes, self._pictures, self._time, self._unread = builder, nodes, pictures, time, unread

    def add(self, prim: Any, matrix: _Matrix) -> bool:
        """Add a camera or a light that stands by a matrix; return whether the prim is one."""
        if prim.IsA(UsdGeom.Camera):
            self._add_camera(UsdGeom.Camera(prim), matrix)
        elif prim.IsA(UsdLux.DistantLight):
            light = UsdLux.DistantLight(prim)
            half = math.radians(self._number(light.GetAngleAttr(), 0.53)) / 2
            area = math.pi * math.sin(half) ** 2
            self._add_light(light, matrix, {"type": "directional"}, area, 1 / area if area > 0 else 0.0)
        elif prim.IsA(UsdLux.SphereLight):
            self._add_sphere(UsdLux.SphereLight(prim), matrix)
        elif prim.IsA(UsdLux.DomeLight) or prim.IsA(UsdLux.DomeLight_1):
            self._add_dome(prim, matrix)
        elif prim.HasAPI(UsdLux.LightAPI):
            self._unread.count(f"{prim.GetTypeName()}")
        else:
            return False
        return True

    def note_copied(self, prim: Any) -> None:
        """Count a camera or a light that copies share as unread."""
        if prim.IsA(UsdGeom.Camera):
            self._unread.count("camera in a copy", "cameras in copies")
        elif prim.HasAPI(UsdLux.LightAPI):
            self._unread.count("light in a copy", "lights in copies")

    def _add_camera(self, camera: Any, matrix: _Matrix) -> None:
        height = self._number(camera.GetVerticalApertureAttr(), 0.0)
        focus = self._number(camera.GetFocalLengthAttr(), 0.0)
        if camera.GetProjectionAttr().Get(self._time) == UsdGeom.Tokens.orthographic or min(height, focus) <= 0:
            self._unread.count("orthographic camera")
            return
        lens = {"yfov": 2 * math.atan2(height, 2 * focus), "znear": 0.1}
        number = self._builder.add("cameras", {"type": "perspective", "perspective": lens})
        self._nodes.add({"camera": number, "name": camera.GetPrim().GetName()}, matrix)

    def _add_sphere(self, light: Any, matrix: _Matrix) -> None:
        """Add a point or spot light. A point has no area: its intensity is that of a normalised sphere of any size."""
        is_point = bool(light.GetTreatAsPointAttr().Get(self._time))
        radius = 0.0 if is_point else self._number(light.GetRadiusAttr(), 0.5) * self._nodes.unit
        radius *= float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
        angle = self._number(UsdLux.ShapingAPI(light).GetShapingConeAngleAttr(), 180.0)
        values: Header = {"type": "point"}
        if 0 < angle <= 90:
            values = {"type": "spot", "spot": {"outerConeAngle": math.radians(angle)}}
        disc = math.pi * radius**2
        self._add_light(light, matrix, values, disc or 0.25, 1 / (4 * disc) if disc > 0 else 1.0)

    def _add_light(self, light: Any, matrix: _Matrix, values: Header, area: float, normalised: float) -> None:
        """Add a light of an area whose radiance is multiplied by `normalised` if the light says so."""
        colour, radiance = self._radiance(light)
        strength = radiance * (area or 1.0)
        if light.GetNormalizeAttr().Get(self._time):
            strength *= normalised or 1.0
        if strength <= 0:
            return
        listed = self._builder.header.setdefault("extensions", {}).setdefault(LIGHTS, {"lights": []})["lights"]
        listed.append(values | {"color": colour, "intensity": strength})
        name = light.GetPrim().GetName()
        self._nodes.add({"name": name, "extensions": {LIGHTS: {"light": len(listed) - 1}}}, matrix)

    def _radiance(self, light: Any) -> tuple[list[float], float]:
        """Return the colour of a light, and its radiance before it is normalised."""
        given = light.GetColorAttr().Get(self._time) or (1.0, 1.0, 1.0)
        colour = [max(float(term), 0.0) if math.isfinite(term) else 1.0 for term in given]
        if light.GetEnableColorTemperatureAttr().Get(self._time):
            tint = UsdLux.BlackbodyTemperatureAsRgb(self._number(light.GetColorTemperatureAttr(), 6500.0))
            colour = [term * max(float(other), 0.0) for term, other in zip(colour, tint, strict=True)]
        most = max(*colour, 1.0)
        exposure = min(max(self._number(light.GetExposureAttr(), 0.0), -60.0), 60.0)
        strength = max(self._number(light.GetIntensityAttr(), 1.0), 0.0) * 2.0**exposure
        return [term / most for term in colour], strength * most

    def _add_dome(self, prim: Any, matrix: _Matrix) -> None:
        """Note the picture of a dome light, or count the light as unread if it has none, or if another one has."""
        light = (UsdLux.DomeLight if prim.IsA(UsdLux.DomeLight) else UsdLux.DomeLight_1)(prim)
        asset = light.GetTextureFileAttr().Get(self._time)
        extras = self._builder.header.setdefault("extras", {})
        latlong = light.GetTextureFormatAttr().Get(self._time) in ("automatic", "latlong", None)
        if not isinstance(asset, Sdf.AssetPath) or not asset.path or SKY in extras or not latlong:
            self._unread.count("dome light without picture that is read", "dome lights without picture that is read")
            return
        data = self._pictures.data(asset, str(prim.GetPath()))
        if data is None:
            self._unread.count("dome light whose picture is missing", "dome lights whose pictures are missing")
            return
        world = self._nodes.world[:3, :3] @ matrix[:3, :3]
        # The middle of a latlong picture is +z of the light (OpenEXR's convention), −z with a turn of 0 here.
        turn = math.degrees(math.atan2(-world[0, 2], -world[2, 2]))
        suffix = "." + asset.path.rsplit(".", 1)[-1].rstrip("]").lower()[:5]
        extras[SKY] = {
            "picture": self._builder.view(data), "suffix": suffix, "turn": turn, "intensity": self._radiance(light)[1],
        }  # fmt: skip

    def _number(self, attribute: Any, default: float) -> float:
        """Return a number of an attribute, the default if it has none that is finite."""
        value = attribute.Get(self._time) if attribute else None
        return float(value) if isinstance(value, int | float) and math.isfinite(value) else default

"""Make the USD files that fuzzing begins with; none without usd-core."""

import tempfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from fuzz.case import Files
from fuzz.seeds import picture

_SCENE = b"""#usda 1.0
(
  defaultPrim = "World"
  metersPerUnit = 1
  timeCodesPerSecond = 24
)
def Xform "World"
{
  def Mesh "square" (
    prepend apiSchemas = ["MaterialBindingAPI"]
  )
  {
    rel material:binding = </World/Skin>
    int[] faceVertexCounts = [4, 3]
    int[] faceVertexIndices = [0, 1, 2, 3, 0, 1, 4]
    point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 1), (0, 3, 2)]
    normal3f[] normals = [(0, 0, 1), (0, 1, 0)] (
      interpolation = "uniform"
    )
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1)] (
      interpolation = "faceVarying"
    )
    int[] primvars:st:indices = [0, 1, 2, 0, 1, 2, 0]
    double3 xformOp:translate.timeSamples = {0: (0, 0, 0), 24: (1, 0, 0)}
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def GeomSubset "part"
    {
      uniform token elementType = "face"
      uniform token familyName = "materialBind"
      int[] indices = [1]
    }
  }
  def Material "Skin"
  {
    token outputs:surface.connect = </World/Skin/Surface.outputs:surface>
    def Shader "Surface"
    {
      uniform token info:id = "UsdPreviewSurface"
      color3f inputs:diffuseColor.connect = </World/Skin/Picture.outputs:rgb>
      float inputs:opacity.connect = </World/Skin/Picture.outputs:r>
      float inputs:roughness = 0.4
      token outputs:surface
    }
    def Shader "Picture"
    {
      uniform token info:id = "UsdUVTexture"
      asset inputs:file = @./skin.png@
      float3 outputs:rgb
      float outputs:r
    }
  }
  def PointInstancer "points"
  {
    rel prototypes = [</World/points/one>]
    int[] protoIndices = [0, 0]
    point3f[] positions = [(3, 0, 0), (5, 0, 0)]
    quath[] orientations = [(1, 0, 0, 0), (0, 1, 0, 0)]
    float3[] scales = [(1, 1, 1), (2, 1, 1)]
    def "one" (
      references = </World/square>
      instanceable = true
    )
    {
    }
  }
}
"""


@cache
def usds() -> list[Files]:
    """Return a scene as text, as a crate file, and in an archive."""
    if find_spec("pxr") is None:
        return []
    from pxr import Sdf, UsdUtils

    skin = picture("PNG")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.usda").write_bytes(_SCENE)
        (folder / "skin.png").write_bytes(skin)
        Sdf.Layer.FindOrOpen(str(folder / "scene.usda")).Export(str(folder / "scene.usdc"))
        UsdUtils.CreateNewUsdzPackage(str(folder / "scene.usda"), str(folder / "scene.usdz"))
        made = {suffix: (folder / f"scene{suffix}").read_bytes() for suffix in (".usda", ".usdc", ".usdz")}
    return [{f"scene{suffix}": data, "skin.png": skin} for suffix, data in made.items()]

"""List the words of each format, which are put into files where chance alone would hardly spell them.

Those of scene files and camera paths come from the schema of these files.
"""

from pydantic import BaseModel

from depthwalk.scene.path import PathFile
from depthwalk.scene.schema import SceneFile

Words = tuple[bytes, ...]


def _schema_keys(model: type[BaseModel]) -> tuple[str, ...]:
    schema = model.model_json_schema()
    nodes = (schema, *schema.get("$defs", {}).values())
    return tuple(sorted({key for node in nodes for key in node.get("properties", {})}))


def _words(*lines: bytes) -> Words:
    return tuple(word for line in lines for word in line.split(b"|"))


SCENE_KEYS, PATH_KEYS = _schema_keys(SceneFile), _schema_keys(PathFile)
GLTF_KEYS = (
    *("sparse", "normalized", "byteOffset", "byteStride", "uri", "extensionsRequired", "extensions", "matrix"),
    *("children", "mesh", "mode", "indices", "TEXCOORD_0", "COLOR_0", "NORMAL", "JOINTS_0", "count", "images"),
    *("scale", "rotation", "name", "skin", "camera", "targets", "KHR_texture_transform", "componentType"),
    *("normalTexture", "texCoord", "EXT_mesh_gpu_instancing", "KHR_lights_punctual", "light", "TRANSLATION", "nodes"),
    *("animations", "channels", "sampler", "input", "output", "interpolation", "CUBICSPLINE", "STEP", "path", "node"),
    *("KHR_draco_mesh_compression", "attributes", "bufferView"),
    *("KHR_meshopt_compression", "fallback", "filter", "OCTAHEDRAL", "EXPONENTIAL", "QUATERNION", "COLOR"),
)
YAML = _words(
    b"&a |*a|!!int |!!float |!!binary |<<: |---\n|...\n|%YAML 1.1\n|%TAG ! x\n|0x|0b|0o8|.inf|.nan|1e999|? |> ",
    b'2001-01-01|"\\ud800"|"\\x00"|\xef\xbb\xbf|\xc2\x85|\xe2\x80\xa8|[|]|{|}|#|!|\'',
)
PLACES = _words(b"x|y|z|yaw|scale|pitch|roll|\"|'|,|\r|\x0b|\x1c|\x85|\n")
OBJ = _words(
    b"v |vt |vn |f |usemtl |mtllib |newmtl |map_Kd |norm |map_Bump |-bm |Kd |Ns |Ks |#|\\\n|//|/|mesh.mtl|skin.png",
    b"../|\xff|\r\n|-1",
)
PLY = _words(
    b"element vertex |element face |element edge |element tristrips |property float |property double |property uchar ",
    b"property list uchar int |vertex_indices|vertex_index|format ascii 1.0\n|format binary_big_endian 1.0\n",
    b"end_header\n|comment TextureFile |nx|ny|nz|u|v|texcoord|red|alpha|skin.png",
)
OFF = _words(b"OFF|COFF|NOFF|STOFF|4OFF|BINARY|#")
USD = _words(
    b"instanceable|references|payload|subLayers|prototypes|visibility|purpose|guide|leftHanded|vertex|faceVarying|constant",
    b"timeSamples|variantSet|over|class|def|inherits|clips|active|None|</World>|@./skin.png@|@../a.usda@|@/a.usda@|(|)|{|}",
)
FBX = _words(
    b"Lcl Translation|Lcl Rotation|Lcl Scaling|RotationActive|RotationOrder|PreRotation|GeometricScaling|Visibility",
    b"ByPolygonVertex|ByVertice|ByPolygon|AllSame|IndexToDirect|Direct|UnitScaleFactor|UpAxis|FBXVersion|Content",
    b"DiffuseColor|NormalMap|TransparentColor|LayeredTexture|Deformer|{|}|*|a: |::|\0\1|skin.png|../",
)
DAE = _words(
    b"polylist|triangles|tristrips|trifans|polygons|<ph>|<h>|<lines>|vcount|instance_node|instance_controller",
    b"lookat|skew|matrix|rotate|scale|Z_UP|X_UP|RGB_ZERO|A_ONE|COLOR|TEXCOORD|NORMAL|stride|offset|count|meter",
    b"<!DOCTYPE x [<!ENTITY a 'b'>]>|&a;|&#0;|<![CDATA[|morph|-1 |skin.png",
)
THREE_DS = (b"\x4d\x4d", b"\x3d\x3d", b"\x00\x40", b"\x00\x41", b"\x10\x41", b"\x20\x41", b"\x30\x41", b"\x40\x41",
            b"\x60\x41", b"\xff\xaf", b"\x00\xa2", b"\x00\xa3", b"\x20\xa0", b"\x54\xa3", b"skin.png\0")  # fmt: skip
THREE_MF = _words(
    b"component|transform|colorgroup|texture2dgroup|basematerials|support|inch|micron|pid|pindex|p1|p:path|objectid",
    b"displaycolor|#ff000080|../|3D/3dmodel.model",
)
STL = _words(b"solid |facet normal |outer loop|vertex |endloop|endfacet|endsolid|FACET")
PICTURE = _words(
    b"IHDR|IDAT|PLTE|tRNS|IEND|acTL|fdAT|RIFF|WEBP|VP8X|ALPH|GIF89a|II*\0|MM\0*|BM|\xff\xd8\xff|DDS |DXT1|P6\n"
)
DEPTH = _words(b"channels|dataWindow|compression|IHDR|IDAT|tRNS|'descr': |'shape': ")
SKY = _words(b"#?RADIANCE|FORMAT=32-bit_rle_rgbe\n|\n\n|-Y 8 +X 16\n|+Y |-X |\x02\x02\0\x10|channels|dataWindow")
BAKED = _words(b"side.0|part1.|border.|dataWindow|channels|depthwalk.steps|depthwalk.key")

"""Set upper bounds on what an input may ask for; each is checked before memory is allocated.

Scene files, meshes and options may come from anybody. Without a bound, a mistyped number or a malicious file would
use up all memory or run for a day before it fails; with one it fails at once, with a message that names the place and
the limit. Each bound is well above what the program can make good use of, so that legitimate input never meets one.
"""

import re

_SIZE = re.compile(r"(\d{1,9}(?:\.\d{1,9})?)\s*([kMGT]?)(i?)B?", re.IGNORECASE | re.ASCII)
_PREFIXES = ("", "k", "m", "g", "t")

MAX_COORDINATE = 1e6
"""Metres from the origin within which files and options may place things: float32 still resolves 6 cm there."""

MIN_FOV, MAX_FOV = 1, 170
"""Degrees, vertical field of view: the perspective projection degenerates towards 0 and 180."""

MAX_SCENE_BYTES = 16 << 20
"""Bytes of a scene or path file: a million objects come from a `grid` or a file of places, not from YAML."""

MAX_PLACES_BYTES = 1 << 29
"""Bytes of a file of places: 134 characters of text for each of MAX_INSTANCES objects."""

MAX_SHININESS = 1024.0
"""Phong exponent of a material: the highlight is then 4° wide. The G-buffer has room for exponents up to here."""

MAX_MESH_BYTES = 4 << 30
"""Bytes of each file that a mesh is read from: a file is held in memory as a whole while it is parsed."""

MAX_MESH_TRIANGLES = 200_000_000
"""Triangles of a mesh: the positions of their corners alone take 7 GB."""

MEMORY_SHARE = 0.75
"""Part of the machine's memory that reading a single input may take (`budget`). The rest is for everything else."""

MAX_COPIED_TRIANGLES = 4_000_000
"""Triangles of a mesh file beyond those that its bytes can hold, as a scene graph makes by placing a mesh repeatedly.
Each takes as much memory as any other triangle; copies placed by a scene file are drawn without being stored."""

MAX_LOOKUPS = 10_000
"""Files that are looked for because a mesh names them; every folder and spelling that is tried counts."""

MAX_JPEG_SCANS = 100
"""Passes over its pixels that a progressive JPEG may take: ten are usual, and each decodes the whole picture again."""

MAX_DEPTH_PIXELS = 1 << 26
"""Pixels of a depth image file: 8192 × 8192. Fitting normals takes half a microsecond and 120 bytes per pixel."""

MAX_TILE_TEXELS = 1 << 22
"""Texels of a tile of a TIFF file beyond the picture's edges: a tile is decoded whole, however little is inside."""

MAX_TEXTURE_SIDE = 16_384
"""Texels along an edge of a texture or a depth image file: what common hardware of OpenGL 3.3 can sample."""

MAX_TEXTURE_PIXELS = 16_384 * 16_384
"""Texels of a texture: a full square of MAX_TEXTURE_SIDE takes 1 GiB decoded, before its mip-maps."""

MAX_SKY_WIDTH = 4_096
"""Texels across a sky's picture on the GPU, where it takes 90 MB with its mip-maps; wider ones are reduced. A view of
75° sees 850 of them."""

MAX_SKY_INTENSITY = 1_000
"""Factor on the light of a picture of the sky: some store daylight as 1/1000 of what it is."""

MAX_NORMAL_SCALE = 100.0
"""Factor on x and y of the normals in a normal map: a slope of one in a hundred then stands at 45°."""

MAX_TRANSLUCENT_TRIANGLES = 250_000
"""Translucent triangles of a mesh, and as many that glow: they are drawn as polygons at any distance, and sorting this
many takes 30 ms."""

MAX_EMISSION = 10_000.0
"""Light that a surface may send out, where 1 is a white surface facing the sun: half floats end at 65504."""

MAX_INSTANCES = 4_000_000
"""Objects of a scene: each takes 37 bytes in the scene's arrays, and as much again in bounds and spatial cells."""

MAX_ASSETS = 4_096
"""Assets of a scene: each that is drawn costs draw calls of its own, and each is baked separately."""

MAX_GROUP_DEPTH = 64
"""Groups within groups: no scene made by hand nests deeper, and the parser's stack stays small."""

MAX_LIGHTS = 1_024
"""Lamps of a scene, besides the sun: the light clusters of the view are built on the CPU in every frame."""

MAX_KEYFRAMES = 100_000
"""Keyframes of a path, and of a recording: about half an hour at 60 per second."""

MAX_FRAMES = 1_000_000
"""Frames of a camera path: more than four hours at 60 per second."""

MIN_DPCI_RESOLUTION = 16
"""Texels along an edge of a depth image: 16² samples are about 500 triangles, as many as a small mesh has."""

MAX_DPCI_RESOLUTION = 4_096
"""Texels along an edge of a depth image: each layer of each face then has 17 million samples."""

MAX_DPCI_LAYERS = 8
"""Layers of depth images per face: each costs as much as the first and shows less than the one before."""

DEFAULT_DPCI_RESOLUTION, DEFAULT_DPCI_LAYERS = 512, 3
"""Defaults within these bounds for scene files, command lines and Python alike."""

MAX_DPCI_PARTS = 16
"""Parts that a mesh is divided into: each has depth images and impostors of its own."""

MAX_BOUNDARY_STRIP_ENTRIES = 1 << 28
"""Vertices and triangles of all boundary strips in a baked file: two thirds of the most texels that it can hold. Strips
lie along silhouettes only and never come near this."""

MAX_CACHE_BYTES = 4 << 30
"""Bytes of the cache folder: a hundred trees or five hundred statues of 512², three layers deep."""

MAX_JOBS = 256
"""Meshes baked at a time, `--jobs`: each takes a process and about a gigabyte."""

MAX_IMAGE_SIDE = 16_384
"""Pixels along an edge of a picture, `--resolution`: as many as of a texture, since pictures are drawn into one."""

MAX_IMAGE_PIXELS = 1 << 26
"""Pixels of a picture, `--resolution`: 8192 × 8192. A frame takes some 50 bytes per pixel on the GPU, so 3 GB."""


def size_in_bytes(text: str) -> int | None:
    """Return the number of bytes that a text such as `500MB`, `4 GiB` or `1000` stands for; None if it is not a size.

    Parameters
    ----------
    text
        A number with B, kB, MB, GB or TB (powers of 1000) or KiB, MiB, GiB or TiB (powers of 1024).
    """
    match = _SIZE.fullmatch(text.strip())
    if match is None:
        return None
    number, prefix, binary = match.groups()
    return int(float(number) * (1024 if binary else 1000) ** _PREFIXES.index(prefix.lower()))

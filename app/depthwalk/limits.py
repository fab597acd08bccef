"""Set upper bounds on what an input may ask for, each checked before memory is allocated.

A scene file, a mesh or an option may come from anybody. Without a bound a mistyped number, or a file made to do harm,
would take all memory or all of a day before it fails; with one it fails at once, with a message that names the place
and the limit. Each bound is well above what the program can make good use of, so that nobody meets one by honest work.
"""

import re

_SIZE = re.compile(r"(\d{1,9}(?:\.\d{1,9})?)\s*([kMGT]?)(i?)B?", re.IGNORECASE | re.ASCII)
_PREFIXES = ("", "k", "m", "g", "t")

MAX_COORDINATE = 1e6
"""Metres from the origin at which files and options may place anything: float32 still resolves 6 cm there."""

MIN_FOV, MAX_FOV = 1, 170
"""Degrees, vertical angle of view: the projection of a plane degenerates towards 0 and 180."""

MAX_SCENE_BYTES = 16 << 20
"""Bytes of a scene or path file: a million objects come from `grid` or from a file of places, not from YAML."""

MAX_PLACES_BYTES = 1 << 29
"""Bytes of a file of places: 134 characters of text for each of MAX_INSTANCES objects."""

MAX_SHININESS = 1024.0
"""Phong exponent of a material: the highlight is then 4° wide. The G-buffer has room for exponents up to here."""

MAX_MESH_BYTES = 4 << 30
"""Bytes of each file that a mesh is read from: files are held in memory as a whole while they are parsed."""

MAX_MESH_TRIANGLES = 200_000_000
"""Triangles of a mesh: the positions of their corners alone take 7 GB."""

MEMORY_SHARE = 0.75
"""Of the machine's memory: what reading a single input may take (`budget`). The rest is for the program and others."""

MAX_COPIED_TRIANGLES = 4_000_000
"""Triangles of a mesh file beyond those that its bytes can hold: a scene graph that places a mesh again and again makes
them. Each takes as much memory as any other; a scene file draws copies without holding them."""

MAX_LOOKUPS = 10_000
"""Files that are looked for because a mesh names them, each folder and spelling that is tried counted."""

MAX_JPEG_SCANS = 100
"""Passes over its pixels that a progressive JPEG may take: ten are usual, and each decodes the whole picture again."""

MAX_DEPTH_PIXELS = 1 << 26
"""Pixels of a depth image file: 8192 × 8192. Normals are fitted in half a microsecond each, by 120 bytes each."""

MAX_TILE_TEXELS = 1 << 22
"""Texels of a tile of a TIFF file beyond those of the picture: one tile is decoded as a whole, however little shows."""

MAX_TEXTURE_SIDE = 16_384
"""Texels along an edge of a texture or a depth image file: what common hardware of OpenGL 3.3 can sample."""

MAX_TEXTURE_PIXELS = 16_384 * 16_384
"""Texels of a texture: a full square of MAX_TEXTURE_SIDE takes 1 GiB decoded, before its mip-maps."""

MAX_TRANSLUCENT_TRIANGLES = 250_000
"""Triangles of a mesh that let light through, and as many that glow: they are drawn as polygons at any distance, and
sorting as many takes 30 ms."""

MAX_EMISSION = 10_000.0
"""Light that a surface may send out, where 1 is a white surface facing the sun: half floats end at 65504."""

MAX_INSTANCES = 4_000_000
"""Objects of a scene: each takes 37 bytes in the scene's arrays, and as much again in bounds and spatial cells."""

MAX_ASSETS = 4_096
"""Assets of a scene: each that is drawn costs draw calls of its own, and each is baked by itself."""

MAX_GROUP_DEPTH = 64
"""Groups within groups: no scene made by hand nests deeper, and the parser's stack stays small."""

MAX_LIGHTS = 1_024
"""Lamps of a scene, besides the sun: the lists of the view's clusters are built on the CPU in every frame."""

MAX_KEYFRAMES = 100_000
"""Keyframes of a path, and of a recording: about half an hour at 60 per second."""

MAX_FRAMES = 1_000_000
"""Frames that a path may make: more than four hours at 60 per second."""

MIN_DPCI_RESOLUTION = 16
"""Texels along an edge of a depth image: 16² samples are about 500 triangles, as many as a small mesh has."""

MAX_DPCI_RESOLUTION = 4_096
"""Texels along an edge of a depth image: each layer of each face then has 17 million samples."""

MAX_DPCI_LAYERS = 8
"""Layers of depth images per face: each costs as much as the first and shows less than the one before."""

DEFAULT_DPCI_RESOLUTION, DEFAULT_DPCI_LAYERS = 512, 3
"""What holds between these bounds where nobody says: in scene files, on command lines and from Python."""

MAX_DPCI_PARTS = 16
"""Parts that a mesh is divided into: each has depth images and impostors of its own."""

MAX_BOUNDARY_STRIP_ENTRIES = 1 << 28
"""Vertices and triangles of all boundary strips in a baked file: two thirds of the most texels that it can hold, which
strips, lying along outlines, never reach."""

MAX_CACHE_BYTES = 4 << 30
"""Bytes of the cache folder: a hundred trees or five hundred statues of 512², three layers deep."""

MAX_JOBS = 256
"""Meshes baked at a time, `--jobs`: each takes a process and about a gigabyte."""

MAX_IMAGE_SIDE = 16_384
"""Pixels along an edge of a picture, `--resolution`: the same as for textures, which a picture is while it is drawn."""

MAX_IMAGE_PIXELS = 1 << 26
"""Pixels of a picture, `--resolution`: 8192 × 8192. A frame takes some 50 bytes per pixel on the GPU, so 3 GB."""


def size_in_bytes(text: str) -> int | None:
    """Return the bytes that a text such as `500MB`, `4 GiB` or `1000` stands for; None if it is no size.

    Parameters
    ----------
    text
        A number, and B, kB, MB, GB or TB in powers of 1000, KiB, MiB, GiB or TiB in powers of 1024.
    """
    match = _SIZE.fullmatch(text.strip())
    if match is None:
        return None
    number, prefix, binary = match.groups()
    return int(float(number) * (1024 if binary else 1000) ** _PREFIXES.index(prefix.lower()))

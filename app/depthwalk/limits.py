"""Upper bounds on what an input may ask for, each checked before memory is allocated."""

MAX_COORDINATE = 1e6  # metres, of what files and options place; float32 still resolves 6 cm there
MIN_FOV, MAX_FOV = 1, 170  # degrees, vertical
MAX_SCENE_BYTES = 16 << 20  # a scene or path file; a million objects come from `grid`, not from text
MAX_PLACES_BYTES = 1 << 29  # a file of places: text of the most objects there may be
MAX_SHININESS = 1024.0  # Phong exponent of a material
MAX_MESH_BYTES = 4 << 30
MAX_MESH_TRIANGLES = 200_000_000
MAX_TEXTURE_SIDE = 16_384  # the GL 3.3 floor of common hardware
MAX_TEXTURE_PIXELS = 16_384 * 16_384
MAX_INSTANCES = 4_000_000
MAX_ASSETS = 4_096
MAX_GROUP_DEPTH = 64
MAX_LIGHTS = 1_024  # of a scene, besides the sun
MAX_KEYFRAMES = 100_000
MAX_FRAMES = 1_000_000
MIN_DPCI_RESOLUTION = 16
MAX_DPCI_RESOLUTION = 4_096
MAX_DPCI_LAYERS = 8
MAX_DPCI_PARTS = 16
MAX_BORDER_ENTRIES = 1 << 28  # vertices and triangles of all borders in a file: two thirds of the most texels
MAX_CACHE_BYTES = 4 << 30  # a hundred trees or five hundred statues of 512², three layers deep
MAX_JOBS = 256  # --jobs: each takes a gigabyte
MAX_IMAGE_SIDE = 16_384  # --resolution
MAX_IMAGE_PIXELS = 1 << 26  # the same: 8192 × 8192; a frame takes some 50 bytes a pixel on the GPU

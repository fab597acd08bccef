"""Convert the materials in the libraries of OBJ files, with the pictures that they name."""

import io
import logging
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import quoted
from depthwalk.ingest.formats import IMAGE_SUFFIXES
from depthwalk.ingest.image import TextureDecoder, open_image
from depthwalk.ingest.materials import phong_from_mtl
from depthwalk.ingest.mesh import Material
from depthwalk.ingest.mtl import MtlMaterial, read_materials
from depthwalk.ingest.normal_maps import bump_scale, is_height_map, normals_from_heights
from depthwalk.ingest.sources import Sources, find, texture_name

if TYPE_CHECKING:
    from PIL import Image

log = logging.getLogger(__name__)

_HEIGHT_BYTES = 32  # per texel while a height map is converted


class MaterialLibrary:
    """Convert the materials in an OBJ file's libraries, each when it is first requested.

    Every texture that a library names is checked when the library is read, whether or not it is used: a scene that
    works must not fail once an object is given another of the materials.
    """

    def __init__(self, libraries: list[Path], mesh: Path, sources: Sources) -> None:
        """Read material libraries.

        Parameters
        ----------
        libraries
            The MTL files, whose folders are searched for textures after that of `mesh`.
        mesh
            The OBJ file that names them. Its folder is searched for textures first, and none outside the tree of that
            folder is used; warnings and errors name the file.
        sources
            Reads files and keeps their bytes.

        Raises
        ------
        InputError
            If a texture is not a picture.
        """
        self._mesh = mesh
        self._sources = sources
        self._folders = list(dict.fromkeys([mesh.parent, *(library.parent for library in libraries)]))
        self._materials = read_materials(libraries, sources)
        self._files: dict[str, Path | None] = {}
        self._textures = TextureDecoder()
        self._from_heights: dict[int, NDArray[np.uint8]] = {}  # normal maps, by the identity of the height maps
        checked: set[Path | None] = {None}
        named = (name for material in self._materials.values() for name in material.pictures)
        for name in dict.fromkeys(named):
            path = self._files[name] = find(texture_name(name), self._folders, sources, mesh)
            if path not in checked and (image := self._open(path)) is not None:
                image.close()
            checked.add(path)

    def material(self, name: str | None) -> Material | None:
        """Return the material `name`; None if the libraries do not have it.

        Raises InputError if its texture cannot be decoded.
        """
        if name is None or (found := self._materials.get(name)) is None:
            return None
        if found.mask is not None and found.mask != found.image:
            log.warning("%s: map_d %s is ignored: it is not the picture of map_Kd", self._mesh, found.mask)
        cut_out = found.mask is not None and found.mask == found.image
        called = f"{self._mesh}: material {quoted(name)}"
        return phong_from_mtl(
            found.terms,
            self._decoded(found.image),
            called,
            cut_out=cut_out,
            emission_texture=self._decoded(found.glow),
            normal_map=self._normal_map(found),
            normal_scale=bump_scale(found.normals or found.bump or ""),
            textures=self._textures,
        )

    def _normal_map(self, found: MtlMaterial) -> NDArray[np.uint8] | None:
        """Return the normal map of a material, converted once if the library names a height map; None if none."""
        picture = self._decoded(found.normals or found.bump)
        if found.normals or picture is None or not is_height_map(picture):
            return picture
        if id(picture) not in self._from_heights:
            check_memory(self._mesh, _HEIGHT_BYTES * picture[..., 0].size, "the normal map of a height map")
            self._from_heights[id(picture)] = normals_from_heights(picture)
        return self._from_heights[id(picture)]

    def _decoded(self, name: str | None) -> NDArray[np.uint8] | None:
        """Return the texels of the picture that a library calls `name`; None if there is none."""
        path = self._files[name] if name else None
        image = self._open(path)
        return None if image is None else self._textures.decode(image, f"{self._mesh}: {name}", path)

    def _open(self, path: Path | None) -> "Image.Image | None":
        """Return the picture without decoding pixels; None if there is none, with a warning if no name said so."""
        if path is None:
            return None
        data = self._sources.read(path)
        if path.suffix.lower() in IMAGE_SUFFIXES:
            return open_image(data, str(path))
        from PIL import Image

        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return Image.open(io.BytesIO(data))  # unsupported formats are reported by name later
        except Exception:  # Pillow's plugins raise nearly anything
            log.warning("%s: %s cannot be read as an image; ignored", self._mesh, path.name)
            return None

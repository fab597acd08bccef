"""Convert the materials of MTL files and of other formats with their terms, with the pictures that they name."""

import io
import logging
import warnings
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
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
    """Convert the materials of a mesh, each when it is first requested.

    Every texture that a material names is checked at first, whether or not it is used: a scene that works must not fail
    once an object is given another of the materials.
    """

    def __init__(
        self,
        materials: Mapping[str, MtlMaterial],
        folders: list[Path],
        mesh: Path,
        sources: Sources,
        embedded: Mapping[str, bytes] = MappingProxyType({}),
    ) -> None:
        """Find the pictures of materials.

        Parameters
        ----------
        materials
            The materials by name.
        folders
            Where their pictures are searched, in this order; the first must be that of `mesh`, and none outside its
            tree is used.
        mesh
            The mesh file; warnings and errors name it.
        sources
            Reads files and keeps their bytes.
        embedded
            The pictures that are not in files of their own, by the names that the materials have for them.

        Raises
        ------
        InputError
            If a texture is not a picture.
        """
        self._mesh = mesh
        self._sources = sources
        self._materials, self._embedded = materials, embedded
        self._files: dict[str, Path | None] = {}
        self._textures = TextureDecoder()
        self._from_heights: dict[int, NDArray[np.uint8]] = {}  # normal maps, by the identity of the height maps
        checked: set[Path | None] = {None}
        named = (name for material in self._materials.values() for name in material.pictures)
        for name in dict.fromkeys(named):
            path = None if name in embedded else find(texture_name(name), folders, sources, mesh)
            self._files[name] = path
            if (path not in checked or name in embedded) and (image := self._open(name)) is not None:
                image.close()
            checked.add(path)

    @classmethod
    def read(cls, libraries: list[Path], mesh: Path, sources: Sources) -> "MaterialLibrary":
        """Read the MTL files `libraries` of the OBJ file `mesh`; their folders are searched for textures after its own.

        Raises InputError as the constructor does.
        """
        folders = list(dict.fromkeys([mesh.parent, *(library.parent for library in libraries)]))
        return cls(read_materials(libraries, sources), folders, mesh, sources)

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
        """Return the texels of the picture that a material calls `name`; None if there is none."""
        image = self._open(name) if name else None
        if image is None or name is None:
            return None
        key = name if name in self._embedded else self._files[name]
        return self._textures.decode(image, f"{self._mesh}: {name}", key)

    def _open(self, name: str) -> "Image.Image | None":
        """Return the picture without decoding pixels; None if there is none, with a warning if no name said so."""
        path = self._files[name]
        if name in self._embedded:
            data, called, file = self._embedded[name], f"{self._mesh}: {name}", Path(name.replace("\\", "/"))
        elif path is not None:
            data, called, file = self._sources.read(path), str(path), path
        else:
            return None
        if file.suffix.lower() in IMAGE_SUFFIXES:
            return open_image(data, called)
        from PIL import Image

        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return Image.open(io.BytesIO(data))  # unsupported formats are reported by name later
        except Exception:  # Pillow's plugins raise nearly anything
            log.warning("%s: %s cannot be read as an image; ignored", self._mesh, file.name)
            return None

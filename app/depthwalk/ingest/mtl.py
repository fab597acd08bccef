"""Read the material libraries (MTL) of OBJ files, without the pictures that they name."""

from dataclasses import dataclass, field
from pathlib import Path

from depthwalk.ingest.sources import Sources, arguments, as_utf8, find, find_all, text

_TERMS = ("kd", "ks", "ns", "d", "tr", "ke", "illum")
_PICTURES = {  # the attribute for each key that names a picture
    "map_kd": "image",
    "map_ke": "glow",
    "map_d": "mask",
    "norm": "normals",
    "map_bump": "bump",
    "bump": "bump",
}

Terms = dict[str, float | list[float]]


@dataclass
class MtlMaterial:
    """Hold the entries of one material in an MTL library.

    Attributes
    ----------
    terms
        Numbers or lists of numbers by their keys in lower case, such as "kd".
    image
        The name after `map_Kd`; None if there is none.
    mask
        The name after `map_d`, the picture whose alpha marks where there is a surface; None if there is none.
    glow
        The name after `map_Ke`, the picture of the emitted light; None if there is none.
    normals
        The name after `norm`, the normal map; None if there is none.
    bump
        The name after `map_Bump` or `bump`, a height map, or a normal map as some exporters write; None if there is
        none.
    """

    terms: Terms = field(default_factory=dict)
    image: str | None = None
    mask: str | None = None
    glow: str | None = None
    normals: str | None = None
    bump: str | None = None

    @property
    def pictures(self) -> tuple[str, ...]:
        """Return the names of the pictures to read, with their options."""
        surface = self.normals or self.bump
        return tuple(name for name in (self.image, self.glow, surface) if name)


def parse_mtl(contents: str) -> dict[str, MtlMaterial]:
    """Return the materials that the `contents` of an MTL library define, by name.

    Of several materials with one name, the last counts. Unknown keys are skipped.
    """
    materials: dict[str, MtlMaterial] = {}
    current: MtlMaterial | None = None
    for line in contents.splitlines():
        words = line.split()
        if len(words) < 2:
            continue
        key = words[0].lower()
        if key == "newmtl":
            current = materials[" ".join(words[1:])] = MtlMaterial()
        elif current is None:
            continue
        elif key in _PICTURES:
            setattr(current, _PICTURES[key], line.strip()[len(key) :].strip())
        elif key in _TERMS:
            try:
                numbers = [float(word) for word in words[1:]]
            except ValueError:
                continue
            current.terms[key] = numbers[0] if len(numbers) == 1 else numbers
    return materials


def material_libraries(data: bytes, mesh: Path, sources: Sources) -> list[Path]:
    """Return the material libraries that an OBJ file names, if they exist in its folder; the log names the others.

    Parameters
    ----------
    data
        The text of the OBJ file; names in it may contain blanks.
    mesh
        The OBJ file; libraries lie in its folder, and warnings name it.
    sources
        Reads files and keeps their bytes.

    Returns
    -------
    list
        The MTL files, in the order of their names in the file.
    """
    libraries: list[Path] = []
    folders = [mesh.parent]
    if not (b"b" in data or b"B" in data) or b"mtllib" not in data.lower():  # avoids scanning a million lines
        return libraries
    data = as_utf8(data)
    for line in arguments(data, b"mtllib"):
        name, words = text(line), text(line).split()
        several = not find(name, folders, sources) and bool(find_all(words, folders, sources))
        libraries += find_all(words if several else [name], folders, sources, mesh)
    return list(dict.fromkeys(libraries))


def read_materials(libraries: list[Path], sources: Sources) -> dict[str, MtlMaterial]:
    """Return the materials of the MTL files `libraries`, read through `sources`, by name."""
    return parse_mtl(text(b"\n".join(as_utf8(sources.read(library)) for library in libraries)))

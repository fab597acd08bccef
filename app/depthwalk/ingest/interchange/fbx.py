"""Read FBX files: models with their meshes and materials, turned and scaled as the file says."""

import base64
import binascii
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from depthwalk.ingest.interchange.fbx_geometry import read_polygons, skinned
from depthwalk.ingest.interchange.fbx_scene import FbxScene
from depthwalk.ingest.interchange.fbx_tree import Node, parse_nodes
from depthwalk.ingest.interchange.model import Model, Placed, PlacingBudget, Polygons, unread_parts
from depthwalk.ingest.mtl import MtlMaterial

# What a picture is for, by the property that it feeds, in lower case without the path of a shader's parameters.
_USES = {
    "diffusecolor": "image",
    "basecolor": "image",
    "base_color": "image",
    "base_color_map": "image",
    "basecolor_map": "image",
    "tex_color_map": "image",
    "emissivecolor": "glow",
    "emissioncolor": "glow",
    "emit_color_map": "glow",
    "tex_emissive_map": "glow",
    "normalmap": "normals",
    "norm_map": "normals",
    "tex_normal_map": "normals",
    "bump": "bump",
    "bump_map": "bump",
    "transparentcolor": "mask",
    "transparencyfactor": "mask",
}


def parse_fbx(data: bytes, path: Path, geometry: bool) -> Model:
    """Parse an FBX file, see `reader.parse`."""
    root, arrays = parse_nodes(data, path)
    scene = FbxScene(root)
    shelf = _Shelf(scene)
    models = [number for number, node in scene.objects.items() if node.name == "Model"]
    names: dict[int, list[str | None]] = {
        model: [shelf.name(material) for material in scene.connected(model, "Material")] for model in models
    }
    placed: list[Placed] = []
    budget = PlacingBudget(data, path)
    meshes: dict[int, Polygons | None] = {}
    for model in models if geometry else ():
        visible = scene.value(model, "Visibility")
        if visible and not visible[0]:
            continue
        for number in scene.connected(model, "Geometry"):
            if number not in meshes:
                before = arrays.decoded
                meshes[number] = read_polygons(scene.objects[number])
                budget.decoded(arrays.decoded - before)
            if (polygons := meshes[number]) is not None:
                budget.place(polygons)
                placed.append(_placed(scene, model, number, _with_materials(polygons, names[model])))
    return Model(placed=placed, materials=shelf.materials, embedded=shelf.embedded, unread=_unread(scene))


def _unread(scene: FbxScene) -> tuple[str, ...]:
    nodes = scene.objects.values()
    # Most files have an animation, whether or not anything moves in it.
    moves = any(node.name == "AnimationCurve" for node in nodes)
    kinds = [(node.name, node.properties[2] if len(node.properties) > 2 else "") for node in nodes]
    return unread_parts(
        animations=sum(node.name == "AnimationStack" for node in nodes) if moves else 0,
        cameras=kinds.count(("NodeAttribute", "Camera")),
        lamps=kinds.count(("NodeAttribute", "Light")),
        shapes=kinds.count(("Deformer", "BlendShapeChannel")),
    )


def _with_materials(polygons: Polygons, names: list[str | None]) -> Polygons:
    """Return polygons with the materials of the model that shows them."""
    known = (polygons.material >= 0) & (polygons.material < len(names))
    return replace(polygons, material=np.where(known, polygons.material, 0), names=tuple(names) or (None,))


def _placed(scene: FbxScene, model: int, geometry: int, polygons: Polygons) -> Placed:
    placing = scene.world(model) @ scene.geometric(model)
    held = skinned(scene, geometry, polygons, placing)
    if held is not None:
        return Placed(polygons=held, matrix=scene.file_from_scene)
    return Placed(polygons=polygons, matrix=scene.file_from_scene @ placing)


class _Shelf:
    """Read the materials of a scene, with the names of their pictures, and the pictures in the file."""

    def __init__(self, scene: FbxScene) -> None:
        """Read the materials, in the file's order."""
        self._scene = scene
        self._names: dict[int, str] = {}
        self.materials: dict[str, MtlMaterial] = {}
        self.embedded: dict[str, bytes] = {}
        for number, node in scene.objects.items():
            if node.name == "Material":
                name = _plain(node)
                self._names[number] = name = name if name not in self.materials else f"{name} {number}"
                self.materials[name] = self._material(number)

    def name(self, number: int) -> str:
        """Return the name of a material."""
        return self._names[number]

    def _material(self, number: int) -> MtlMaterial:
        made = MtlMaterial(terms=self._terms(number))
        for source, use in self._scene.connected_uses(number, ("Texture", "LayeredTexture")):
            kind = _USES.get(use.rsplit("|", 1)[-1].lower())
            if kind and getattr(made, kind) is None and (picture := self._picture(source)):
                setattr(made, kind, picture)
        if made.image:
            made.terms.pop("kd", None)  # a picture replaces the colour that it feeds
        if made.glow:
            made.terms.pop("ke", None)
        if made.mask != made.image:
            made.mask = None  # only the alpha of the picture of colours can cut out
        return made

    def _terms(self, number: int) -> dict[str, float | list[float]]:
        """Return the numbers of a material by the keys of MTL files."""
        scene = self._scene
        terms: dict[str, float | list[float]] = {}
        for key, names, factor in (
            ("kd", ("3dsMax|Parameters|base_color", "3dsMax|main|basecolor", "Maya|baseColor", "Maya|base_color",
                    "DiffuseColor", "Diffuse"), "DiffuseFactor"),
            ("ks", ("SpecularColor", "Specular"), "SpecularFactor"),
            ("ke", ("EmissiveColor", "Emissive"), "EmissiveFactor"),
        ):  # fmt: skip
            if (colour := _rgb(scene.value(number, *names))) is not None:
                # Maya's exporter writes a factor of 0 beside a colour that its viewport shows.
                by = scene.scalar(number, factor, 1.0) if key != "kd" else scene.scalar(number, factor, 1.0) or 1.0
                terms[key] = [by * each for each in colour]
        terms["ns"] = scene.scalar(number, "ShininessExponent", scene.scalar(number, "Shininess", 32.0))
        model = str(scene.objects[number].first("ShadingModel", "")).lower()
        if model == "lambert":
            terms["illum"] = 1
        terms["d"] = self._opacity(number)
        return terms

    def _opacity(self, number: int) -> float:
        """Return the opacity of a material; what would be clear altogether is opaque, as programs write it."""
        scene = self._scene
        given = scene.value(number, "Opacity")
        if given and isinstance(given[0], (int, float)):
            opacity = float(given[0])
        else:
            clear = _rgb(scene.value(number, "TransparentColor"))
            opacity = 1 - scene.scalar(number, "TransparencyFactor", 0.0) * (1.0 if clear is None else sum(clear) / 3)
        return opacity if 0 < opacity <= 1 else 1.0

    def _picture(self, number: int) -> str | None:
        """Return the name of the picture of a texture, or of the first layer of one of several."""
        scene = self._scene
        if scene.kind(number) == "LayeredTexture":
            layers = scene.connected(number, "Texture")
            return self._picture(layers[0]) if layers else None
        node = scene.objects[number]
        name = str(node.first("RelativeFilename") or node.first("FileName") or "")
        for video in scene.connected(number, "Video"):
            clip = scene.objects[video]
            name = name or str(clip.first("RelativeFilename") or clip.first("Filename") or _plain(clip))
            if content := _content(clip):
                self.embedded[name] = content
        return name or None


def _plain(node: Node) -> str:
    """Return the name of an object, without the kind that the file adds to it."""
    name = str(node.properties[1]) if len(node.properties) > 1 else ""
    return name.split("\0")[0].split("::", 1)[-1]


def _rgb(values: list[Any] | None) -> tuple[float, float, float] | None:
    if values is None or len(values) < 3 or not all(isinstance(each, (int, float)) for each in values[:3]):
        return None
    return float(values[0]), float(values[1]), float(values[2])


def _content(clip: Node) -> bytes:
    """Return the bytes of a picture in the file, in base 64 if it is of text; none if it is beside the file."""
    found = clip.find("Content")
    if found is None:
        return b""
    whole = b"".join(each for each in found.properties if isinstance(each, bytes))
    if whole:
        return whole
    try:
        text = "".join(each for each in found.properties if isinstance(each, str))
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        return b""

"""Write small scenes as 3MF files."""

import io
import zipfile

import numpy as np

from depthwalk.colour import srgb8_from_linear
from fuzz.case import Files
from fuzz.small_scenes import Y_FROM_Z, Use, distinct, fans, words_of


def three_mf(uses: list[Use], pictures: Files, *, unit: str = "meter", parts: bool = False) -> Files:
    """Return a 3MF file with its pictures in it; z is up. With `parts`, each object is a model of its own."""
    paints = distinct(uses)[1]
    resources = "".join(
        f'<m:texture2d id="{100 + k}" path="/3D/Textures/{name}" contenttype="image/png"/>'
        for k, name in enumerate(pictures)
    )
    bases = "".join(
        f'<base name="{paint.name}" displaycolor="#{bytes(srgb8_from_linear(np.array(paint.colour)).tolist()).hex()}'
        f'{round(paint.opacity * 255):02x}"/>'
        for paint in paints
    )
    resources += f'<basematerials id="50">{bases}</basematerials>'
    files: Files = {}
    items = ""
    for number, use in enumerate(uses):
        paint, shape = use.paint, use.shape
        group = ""
        at = f'pid="50" pindex="{paints.index(paint)}"'
        if paint.picture and shape.uv is not None:
            picture = 100 + list(pictures).index(paint.picture)
            rows = "".join(f'<m:tex2coord u="{u:.9g}" v="{v:.9g}"/>' for u, v in shape.uv.tolist())
            group = f'<m:texture2dgroup id="{200 + number}" texid="{picture}">{rows}</m:texture2dgroup>'
            at = f'pid="{200 + number}" pindex="0"'
        vertices = "".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in shape.positions.tolist())
        vertex = shape.vertex
        triangles = "".join(
            f'<triangle v1="{vertex[a]}" v2="{vertex[b]}" v3="{vertex[c]}" p1="{a}" p2="{b}" p3="{c}"/>'
            if group
            else f'<triangle v1="{vertex[a]}" v2="{vertex[b]}" v3="{vertex[c]}"/>'
            for a, b, c in fans(shape).tolist()
        )
        drawn = (
            f'{group}<object id="{number + 1}" {at}><mesh><vertices>{vertices}</vertices>'
            f"<triangles>{triangles}</triangles></mesh></object>"
        )
        place = f'transform="{words_of((np.linalg.inv(Y_FROM_Z) @ use.matrix)[:3].T)}"'
        if parts:
            files[f"3D/Objects/{number}.model"] = _mf_model(unit, resources + drawn, "")
            inner = f'<component p:path="/3D/Objects/{number}.model" objectid="{number + 1}" {place}/>'
            resources += f'<object id="{number + 1}"><components>{inner}</components></object>'
            items += f'<item objectid="{number + 1}"/>'
        else:
            resources += drawn
            items += f'<item objectid="{number + 1}" {place}/>'
    relation = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
    files["_rels/.rels"] = (
        '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        f'<Relationship Target="/3D/3dmodel.model" Id="r" Type="{relation}"/></Relationships>'
    ).encode()
    files["3D/3dmodel.model"] = _mf_model(unit, resources, items)
    files |= {f"3D/Textures/{name}": data for name, data in pictures.items()}
    return {"scene.3mf": zipped(files)}


def _mf_model(unit: str, resources: str, items: str) -> bytes:
    spaces = (
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
        'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02" '
        'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
    )
    text = (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="{unit}" {spaces}>\n<resources>{resources}</resources>\n'
        f"<build>{items}</build></model>"
    )
    return text.replace("><", ">\n<").encode()


def zipped(files: Files) -> bytes:
    """Return a ZIP archive of files, the same for the same files."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
    return packed.getvalue()

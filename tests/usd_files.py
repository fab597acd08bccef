"""Write small USD files, and read them without a process for each."""

from collections.abc import Iterable
from pathlib import Path

import pytest

from depthwalk.ingest.usd import translation
from depthwalk.ingest.watched_process import Answer, framed

WEDGE = "(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)"
FACES = "0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3"


def translate_here(patch: pytest.MonkeyPatch) -> None:
    """Let the worker of USD files run in this process, which has its library already; skip the test without it."""
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from depthwalk.ingest.usd.worker import answer

    def run(module: str, request: Iterable[bytes], **limits: float) -> Answer:
        return Answer(True, b"".join(framed(answer(b"".join(request)))), "")

    patch.setattr(translation, "run_watched", run)


def write_usda(path: Path, body: str, *, up: str = "Y", unit: float = 1.0, head: str = "") -> Path:
    """Write a layer of text, whose default prim is `World`, and return its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ["#usda 1.0", "(", '  defaultPrim = "World"', f'  upAxis = "{up}"', f"  metersPerUnit = {unit}", head, ")"]
    path.write_text("\n".join([*lines, body]), encoding="utf-8")
    return path


def xform(name: str, *inside: str, terms: str = "", **ops: str) -> str:
    """Return a prim of type Xform with operations such as `translate="(1, 2, 3)"`, the first outermost."""
    types = {"translate": "double3", "scale": "float3", "rotateXYZ": "float3", "rotateY": "float"}
    lines = [
        f"{types[op]} xformOp:{op}" + (f".timeSamples = {value}" if value.startswith("{") else f" = {value}")
        for op, value in ops.items()
    ]
    if ops:
        lines.append("uniform token[] xformOpOrder = [" + ", ".join(f'"xformOp:{op}"' for op in ops) + "]")
    return prim("Xform", name, *lines, *inside, terms=terms)


def prim(kind: str, name: str, *lines: str, terms: str = "") -> str:
    """Return a prim with lines in it, and `terms` such as references."""
    return "\n".join([f'def {kind} "{name}" (', terms, ")", "{", *lines, "}"])


def mesh(name: str = "mesh", *lines: str, points: str = WEDGE, faces: str = FACES, sizes: str = "3, 3, 3, 3") -> str:
    """Return a mesh, by default a wedge of four triangles, of which no two corners are alike."""
    return prim(
        "Mesh",
        name,
        'uniform token subdivisionScheme = "none"',
        f"int[] faceVertexCounts = [{sizes}]",
        f"int[] faceVertexIndices = [{faces}]",
        f"point3f[] points = [{points}]",
        *lines,
    )


def material(name: str, *inputs: str, textures: str = "", path: str = "/World") -> str:
    """Return a material of UsdPreviewSurface below a prim.

    `textures` has names and files as `C=a.png D=b.png`; `OWN` in inputs is the path of the material.
    """
    own = f"{path}/{name}"
    shaders = [
        prim(
            "Shader",
            shader,
            'uniform token info:id = "UsdUVTexture"',
            f"asset inputs:file = @{file}@",
            f"float2 inputs:st.connect = <{own}/Reader.outputs:result>",
            "float3 outputs:rgb",
            "float outputs:r",
            "float outputs:a",
        )
        for shader, file in (each.split("=") for each in textures.split())
    ]
    reader = prim(
        "Shader",
        "Reader",
        'uniform token info:id = "UsdPrimvarReader_float2"',
        'string inputs:varname = "st"',
        "float2 outputs:result",
    )
    surface = prim(
        "Shader",
        "Surface",
        'uniform token info:id = "UsdPreviewSurface"',
        *(each.replace("OWN", own) for each in inputs),
        "token outputs:surface",
    )
    connection = f"token outputs:surface.connect = <{own}/Surface.outputs:surface>"
    return prim("Material", name, connection, surface, reader, *shaders)

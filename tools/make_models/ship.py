"""Make the files in assets/ that ship, of the demo's models: `python -m tools.make_models.ship [NAME...]`.

Heavy models ship as cooked depth images, NAME.dpci.npz, so that nothing is read, baked or cooked when the demo starts;
their meshes stay in out/models. The few polygons and the textures ship as they are.
"""

import re
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from PIL import Image
from tools.make_models.catalogue import MODELS, TEXTURES, Images
from tools.make_models.generate import OUT, generate, make_folder

from depthwalk.assets.bake_job import Baked, Job, Kept
from depthwalk.assets.batch_bake import bake_all
from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.params import ModelParams
from depthwalk.commands.options import Verbose
from depthwalk.commands.program import as_program, guarded
from depthwalk.cook.cook import CookedObject
from depthwalk.cook.cooked_file import cooked_key, read_cooked, write_cooked
from depthwalk.errors import InputError, suggest
from depthwalk.files import replacing, write_bytes
from depthwalk.ingest.formats import COOKED_SUFFIX
from depthwalk.ingest.loader import load_mesh
from depthwalk.resources import asset_root
from depthwalk.scene.scene import MeshAsset

HEADER = """# Sources of the files in this folder

Everything here is our own work, made by the code in `tools/make_models`; nothing was taken from elsewhere.
`python -m tools.make_models` makes the meshes, in `out/models`, the same bytes every time;
`python -m tools.make_models.ship` bakes and cooks them, which takes some minutes, and writes this folder.

Heavy models ship as cooked depth images, `.dpci.npz`, and without their meshes. The others are binary PLY. All are in
metres, Y up, on y = 0, with sRGB vertex colours. Size is x × y × z.

| file | triangles of the mesh | depth images | size, m | what it is |
|---|---|---|---|---|
"""
TEXTURE_HEADER = """
| file | pixels | what it is |
|---|---|---|
"""


def shipped_name(name: str) -> str:
    """Return the name of the file in assets/ that holds the model called `name`."""
    return name + (".ply" if MODELS[name].images is None else COOKED_SUFFIX)


def ship(names: list[str], models: Path, assets: Path) -> None:
    """Write the files of models and textures that ship, and SOURCES.md, the list of all of them.

    Parameters
    ----------
    names
        Names of models and textures to write; the files of others stay as they are.
    models
        Folder of the meshes and textures; those that are missing are made.
    assets
        Folder to write to. Depth images of the same mesh, baked in the same way, are left as they are.

    Raises
    ------
    InputError
        For an unknown name, and where files cannot be read or written.
    """
    known = [*MODELS, *TEXTURES]
    for name in names:
        if name not in known:
            raise InputError(f"no demo file is called {name!r}{suggest(name, known)}")
    make_folder(models)
    missing = [name for name in names if not _made(name, models).is_file()]
    if missing:
        generate(models, missing)
    heavy = [(name, images) for name in names if name in MODELS and (images := MODELS[name].images)]
    for name in set(names) - {name for name, _ in heavy}:
        shutil.copyfile(_made(name, models), assets / _made(name, models).name)
    jobs = [_job(name, images, models, assets) for name, images in heavy]
    _bake(jobs, {name: images.finest for name, images in heavy})
    rows = _listed(assets) | {name: _row(name, models) for name in names}
    ordered = ["".join(rows.get(name, "") for name in group) for group in (MODELS, TEXTURES)]
    write_bytes(assets / "SOURCES.md", (HEADER + ordered[0] + TEXTURE_HEADER + ordered[1]).encode())


def _made(name: str, models: Path) -> Path:
    return models / (f"{name}.ply" if name in MODELS else f"{name}.png")


def _job(name: str, images: Images, models: Path, assets: Path) -> Job:
    spec = MeshAsset(name=name, mesh=_made(name, models), texture=None, up="y", height=None, dpci=None)
    params = ModelParams(resolution=images.resolution, layers=images.layers)
    return Job(spec=spec, params=params, out=assets / shipped_name(name))


def _bake(jobs: list[Job], finest: dict[str, float]) -> None:
    """Bake and cook, as many models at a time as there are cores, and print a line for each.

    finest: by the name of the model, see `Images`.
    """
    for number, outcome in bake_all(jobs, None, lambda number, stage: None):
        if not isinstance(outcome, Baked | Kept):
            raise outcome
        _coarsen(jobs[number], finest[jobs[number].spec.name])
        took = f", {sum(outcome.seconds.values()):.0f} s" if isinstance(outcome, Baked) else ", is up to date"
        print(f"{jobs[number].out}: {jobs[number].out.stat().st_size / 1e6:.2f} MB{took}", flush=True)


def _coarsen(job: Job, finest: float) -> None:
    """Leave out of a file what nobody would see: levels finer than `finest` texels (see `Images`), bits of normals.

    It is then packed as tightly as can be.
    """
    key = cooked_key(job.out)
    assert key is not None  # it has just been baked, or found up to date
    objects = (without_levels(cooked, finest * square_texel(cooked.outline)) for cooked in read_cooked(job.out))
    write_cooked(job.out, key, tuple(map(with_plain_normals, objects)))
    pack_tightly(job.out)


def pack_tightly(path: Path) -> None:
    """Compress the members of the zip archive `path` again, by Zopfli.

    It is a fifteenth smaller then, and read as before, but compressing takes a minute for 4 MB.
    """
    import zopfli  # here, so that what only reads the catalogue needs no extra

    with (
        replacing(path) as temporary,
        zipfile.ZipFile(path) as archive,
        zopfli.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as packed,
    ):
        for member in archive.infolist():
            packed.writestr(member, archive.read(member))


def with_plain_normals(cooked: CookedObject) -> CookedObject:
    """Return the object `cooked` with normals of 7 bits instead of 8.

    They are off by less than 1°, and the file is a twentieth smaller.
    """
    geometry, texture = cooked.load()
    normals = texture.normals | np.array([1, 1, 1, 0], np.uint8)
    return replace(cooked, load=lambda: (geometry, replace(texture, normals=normals)))


def without_levels(cooked: CookedObject, error: float) -> CookedObject:
    """Return the object `cooked` without the finest levels of detail, whose gain nobody would see.

    The finest level that is kept is the coarsest whose error is at most `error` metres.
    """
    geometry, texture = cooked.load()
    level = max(int(np.searchsorted(geometry.error, error, side="right")) - 1, 0)
    index = int(geometry.first[level].min())
    chunk = int(np.searchsorted(geometry.chunks[:, 0], index))
    if chunk == len(geometry.chunks) or geometry.chunks[chunk, 0] != index:
        return cooked  # grids, whose levels share vertices
    vertex = int(geometry.chunks[chunk, 1])
    kept = replace(
        geometry,
        vertices=geometry.vertices[vertex:],
        texels=geometry.texels[vertex:],
        indices=geometry.indices[index:],
        chunks=geometry.chunks[chunk:] - np.array([index, vertex]),
        first=geometry.first[level:] - index,
        count=geometry.count[level:],
        horizon=geometry.horizon[level:],
        error=geometry.error[level:],
    )
    saved = geometry.vertices[:vertex].nbytes + geometry.indices[:index].nbytes
    return replace(
        cooked,
        first=kept.first,
        count=kept.count,
        horizon=kept.horizon,
        error=kept.error,
        bytes=cooked.bytes - saved,
        load=lambda: (kept, texture),
    )


def _row(name: str, models: Path) -> str:
    """Return the line of SOURCES.md about a model or a texture."""
    if name in TEXTURES:
        with Image.open(_made(name, models)) as picture:
            return f"| {name}.png | {picture.width} × {picture.height} | {TEXTURES[name][1]} |\n"
    mesh, images = load_mesh(_made(name, models)), MODELS[name].images
    size = " × ".join(f"{extent:.2f}" for extent in np.ptp(mesh.positions, axis=0))
    depth_images = "none" if images is None else f"{images.resolution}², {images.layers} deep"
    return f"| {shipped_name(name)} | {len(mesh.faces)} | {depth_images} | {size} | {MODELS[name].about} |\n"


def _listed(assets: Path) -> dict[str, str]:
    """Return the lines of SOURCES.md by the name of the model or texture that each is about."""
    file = assets / "SOURCES.md"
    text = file.read_text("utf-8") if file.is_file() else ""
    return {name: line + "\n" for line, name in re.findall(r"^(\| (\w+)\.[\w.]+ \|.*)$", text, re.MULTILINE)}


@guarded
def main(
    names: Annotated[list[str] | None, typer.Argument(help="Only these models and textures.")] = None,
    models: Annotated[Path, typer.Option(help="Folder of the meshes.")] = OUT,
    verbose: Verbose = False,
) -> None:
    """Make the files that ship: cooked depth images of heavy models, the other meshes, textures, SOURCES.md."""
    ship(names or [*MODELS, *TEXTURES], models, asset_root())


if __name__ == "__main__":
    as_program(main)()

"""Declare `depthwalk bake`, which bakes meshes to files of depth images, several at a time."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk.cluster.address import parse_cluster
from depthwalk.commands.exit_codes import BAD_INPUT, FAILURE
from depthwalk.commands.option_values import parse_axis, parse_layers, parse_parts
from depthwalk.commands.options import (
    Axis,
    ClusterOption,
    Coordinates,
    DpciResolution,
    Height,
    Layers,
    Meshes,
    Method,
    Parts,
    Quiet,
    Texture,
    Up,
    UpAxis,
    Verbose,
    named_files,
    own_file,
)
from depthwalk.commands.program import guarded
from depthwalk.errors import InputError
from depthwalk.ingest.formats import is_cooked_file
from depthwalk.limits import DEFAULT_DPCI_RESOLUTION, MAX_JOBS


@guarded
def main(
    meshes: Meshes,
    out: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE_OR_DIR",
            help="File or existing folder to write to, or its URL; a file whose name ends in .dpci.npz holds cooked "
            "depth images, which open faster.",
            show_default="beside each mesh",
        ),
    ] = None,
    dpci_resolution: DpciResolution = DEFAULT_DPCI_RESOLUTION,
    layers: Layers = None,
    method: Annotated[
        Method,
        typer.Option(
            help="How surfaces are sampled: by ray casting, or from six views warped on the GPU; paper: six views, "
            "without any step that the paper does not describe.",
        ),
    ] = Method.RAYCAST,
    parts: Parts = None,
    axis: Axis = None,
    coordinates: Coordinates = None,
    up: Up = UpAxis.Y,
    height: Height = None,
    texture: Texture = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            max=MAX_JOBS,
            help="Number of meshes to bake at the same time.",
            show_default="one per core",
        ),
    ] = None,
    cluster: ClusterOption = None,
    force: Annotated[
        bool, typer.Option("--force", help="Bake meshes even if their depth images are up to date.")
    ] = False,
    verify: Annotated[
        bool, typer.Option("--verify", help="Measure how closely the depth images resemble the mesh, as compare does.")
    ] = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Bake meshes to depth images, NAME.dpci.exr.

    Scenes that use the mesh with the same settings find the file. Cooked depth images, NAME.dpci.npz, are smaller and
    complete: scenes name them as `baked`, and need no mesh. Depth images that are up to date or in the cache are not
    baked again, so after Ctrl-C the same command continues where it stopped.
    """
    from depthwalk.bake.params import ModelParams
    from depthwalk.commands.baking import bake_meshes, check_inputs, mesh_spec, output_files

    where = parse_cluster(cluster)
    if where and jobs:
        raise InputError("--jobs: cannot be combined with --cluster; --cluster local:N sets the number of processes")
    found = named_files(meshes) if out is not None else [own_file(mesh, "-o") for mesh in meshes]
    files = output_files(found, out)
    specs = [mesh_spec(mesh, texture, up.value, height) for mesh in found]
    check_inputs(specs)
    paths = [file for file in files if isinstance(file, Path)]
    if verify and len(paths) < len(files):
        raise InputError("--verify needs files on this machine, but -o names a URL")
    if verify and any(is_cooked_file(file) for file in paths):
        raise InputError("--verify needs depth images, .dpci.exr; it cannot measure cooked ones, .dpci.npz")
    chosen = parse_layers(layers), parse_parts(parts), parse_axis(axis)
    try:
        params = ModelParams(
            resolution=dpci_resolution,
            layers=chosen[0] or (3 if method is Method.RAYCAST else 1),
            method=method.value,
            parts=chosen[1] or 1,
            axis=chosen[2] or "y",
            coordinates="auto" if coordinates is None else coordinates.value,
        )
    except InputError as error:
        raise InputError(f"--{error}") from None
    failures = bake_meshes(specs, params, files, jobs, force, where)
    if verify:
        from depthwalk.commands.comparison import verify as verify_files  # the only use of a GPU

        verify_files(specs, params, paths)
    if failures:
        raise typer.Exit(BAD_INPUT if all(isinstance(failure, InputError) for failure in failures) else FAILURE)

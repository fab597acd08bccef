"""Declare `depthwalk compare`, which measures the image quality of depth images against their mesh."""

from pathlib import Path
from typing import Annotated

import typer

from depthwalk.cluster.address import parse_cluster
from depthwalk.commands.option_values import (
    parse_axis,
    parse_layers,
    parse_parts,
    parse_resolution,
    parse_settings,
    refuse_reuse,
)
from depthwalk.commands.options import (
    DEFAULT_RESOLUTION,
    Axis,
    CacheLimit,
    ClusterOption,
    Coordinates,
    Height,
    HtmlReport,
    JsonReport,
    Layers,
    Method,
    Parts,
    Quiet,
    Resolution,
    Texture,
    UpAxis,
    Verbose,
)
from depthwalk.commands.program import guarded
from depthwalk.limits import MAX_DPCI_RESOLUTION, MIN_DPCI_RESOLUTION


@guarded
def main(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE",
            help="Meshes or scene files; of a scene, each asset with `dpci` is compared.",
        ),
    ],
    json: JsonReport = None,
    html: HtmlReport = None,
    want_psnr: Annotated[
        float | None,
        typer.Option(metavar="DB", help="Find the cheapest resolution and number of layers that reach this PSNR."),
    ] = None,
    dpci_resolution: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=MIN_DPCI_RESOLUTION,
            max=MAX_DPCI_RESOLUTION,
            help="Width and height of a depth image, texels.",
            show_default="512, or as the scene says",
        ),
    ] = None,
    layers: Layers = None,
    method: Annotated[
        Method | None,
        typer.Option(
            help="How surfaces are sampled: by ray casting, or from six views warped on the GPU; paper: six views, "
            "without any step that the paper does not describe.",
            show_default="raycast, or as the scene says",
        ),
    ] = None,
    parts: Parts = None,
    axis: Axis = None,
    coordinates: Coordinates = None,
    up: Annotated[
        UpAxis | None, typer.Option(help="The axis that points upward in the meshes.", show_default="y")
    ] = None,
    height: Height = None,
    texture: Texture = None,
    cluster: ClusterOption = None,
    resolution: Resolution = DEFAULT_RESOLUTION,
    asset_root: Annotated[
        list[Path] | None,
        typer.Option("--asset-root", metavar="DIR", help="Folder in which to look for the files and those they name."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Use this render setting, as in render.lod.bias=1."),
    ] = None,
    cache_limit: CacheLimit = None,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure how closely baked depth images resemble their mesh.

    Bakes each mesh, whatever the cache holds, and compares pictures of depth images and mesh, seen from all around and
    from close by. After Ctrl-C, the same command continues where it stopped.
    """
    refuse_reuse(settings)
    where = parse_cluster(cluster)
    size = parse_resolution(resolution)
    overrides = parse_settings(settings)
    from depthwalk.commands.comparison import Plan, check_plan, parse_render_settings, run_compare
    from depthwalk.commands.reports import asset_files, check_report_files, write_report
    from depthwalk.commands.subjects import Choices, find_subjects
    from depthwalk.quality.page import to_html
    from depthwalk.quality.report import to_json, to_text

    choices = Choices(
        resolution=dpci_resolution,
        layers=parse_layers(layers),
        method=method.value if method else None,
        parts=parse_parts(parts),
        axis=parse_axis(axis),
        coordinates=coordinates.value if coordinates else None,
        texture=texture,
        up=up and up.value,
        height=height,
    )
    subjects = find_subjects(files, asset_root or [], choices)
    plan = Plan(
        subjects=subjects,
        settings=parse_render_settings(overrides),
        size=size,
        wanted=want_psnr,
        pictures=html is not None,
    )
    check_plan(plan)
    scenes = [subject.scene for subject in subjects if subject.scene is not None]
    inputs = [file for subject in subjects for file in asset_files(subject.spec)]
    check_report_files([json, html], [*inputs, *scenes], "compared")
    with run_compare(plan, where) as (report, worst):
        write_report(json, to_json(report))
        if html is not None:
            write_report(html, to_html(report, worst))
        print(to_text(report))

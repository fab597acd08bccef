"""Write the reports of a command without overwriting any of its input files."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from depthwalk.bake.cache import sidecar
from depthwalk.errors import InputError
from depthwalk.files import check_folder, write_bytes
from depthwalk.ingest.mesh_head import read_head
from depthwalk.scene.scene import Asset, BakedAsset, DepthImageAsset, MeshAsset, Scene, told_at


def own_file(asset: Asset) -> Path:
    """Return the file after which `asset` is named: that of its depth images if it has one, otherwise its mesh."""
    match asset:
        case BakedAsset():
            return asset.baked
        case DepthImageAsset():
            return asset.depth
        case MeshAsset():
            return asset.mesh


def asset_files(asset: Asset) -> list[Path]:
    """Return the files of an asset: its own, those that its mesh names, and the location of its depth images.

    Returns
    -------
    list[Path]
        The files, whether or not they exist.

    Raises
    ------
    InputError
        If the names of its files cannot be read from a mesh.
    """
    file = own_file(asset)
    match asset:
        case BakedAsset():
            return [file, *(asset_files(asset.source) if asset.source else [])]
        case DepthImageAsset():
            files = [file, sidecar(file), asset.colour, asset.normal]
        case MeshAsset():
            meso = asset.dpci.meso if asset.dpci else None
            relief = [meso.depth, meso.normal] if meso else []
            with told_at(asset):
                files = [*read_head(file, asset.texture).files, sidecar(file), *relief]
    return [found for found in files if found is not None]


def readable_files(asset: Asset) -> list[Path]:
    """Return what `asset_files` does; only the asset's own file where others cannot be found out."""
    try:
        return asset_files(asset)
    except InputError:
        return [own_file(asset)]


def input_files(scene: Scene, path: Path | None, of_asset: Callable[[Asset], list[Path]] = asset_files) -> list[Path]:
    """Return every file that a scene uses, so that no output overwrites one.

    Parameters
    ----------
    scene
        The scene.
    path
        A camera path's file, to be returned as well; None for none.
    of_asset
        Returns the files of an asset.

    Returns
    -------
    list[Path]
        The files, whether or not they exist.

    Raises
    ------
    InputError
        If the names of its files cannot be read from a mesh.
    """
    ground, sky = scene.environment.ground, scene.environment.sky
    files = [scene.path, path, ground.texture if ground else None, sky.image if sky else None]
    files += [scene.advice_file, *scene.places_files]
    files += [file for asset in scene.assets for file in of_asset(asset)]
    return [file for file in files if file is not None]


def check_report_files(reports: Iterable[Path | None], inputs: Sequence[Path], use: str) -> None:
    """Check that reports can be written, before anything is measured for them.

    Parameters
    ----------
    reports
        Files to write; None for reports that were not requested.
    inputs
        Files that must not be changed.
    use
        What the command does with the inputs, for the message, such as "measured".

    Raises
    ------
    InputError
        If a report cannot be written, or would overwrite an input or another report.
    """
    taken = {file.resolve() for file in inputs}
    for report in reports:
        if report is not None:
            check_folder(report)
            if report.resolve() in taken:
                raise InputError(f"{report}: would overwrite a file that is {use}, or the other report")
            taken.add(report.resolve())


def write_report(file: Path | None, text: str) -> None:
    """Write `text` to `file`, encoded as UTF-8; None stands for a report that was not requested.

    Raises OSError if the file cannot be written.
    """
    if file is not None:
        write_bytes(file, text.encode())

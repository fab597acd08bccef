"""Find out what resolution a mesh needs: python examples/bake_and_compare.py bust.obj [RESOLUTION …]."""

import argparse
import tempfile
from pathlib import Path

import depthwalk as dw


def main(mesh: str, resolutions: list[int]) -> None:
    """Bake the mesh at each resolution, and print how well the pictures agree with those of the mesh itself."""
    with tempfile.TemporaryDirectory() as folder:
        for resolution in resolutions:
            baked = dw.bake_mesh(mesh, Path(folder) / f"{resolution}.dpci.exr", resolution=resolution)
            found = dw.compare(mesh, baked, size=(320, 240), views=6)
            print(
                f"{resolution}²: {found.mean['psnr']:.1f} dB, worst {found.worst['psnr']:.1f} dB; "
                f"{baked.stat().st_size / 1e6:.1f} MB on disk, {found.gpu_bytes / 1e6:.1f} MB on the GPU"
            )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh")
    parser.add_argument("resolutions", nargs="*", type=int, default=[128, 256, 512])
    main(**vars(parser.parse_args()))

"""Find out what resolution a mesh needs: python examples/bake_and_compare.py bust.obj [RESOLUTION …]."""

import sys
import tempfile
from pathlib import Path

import depthwalk as dw


def main(mesh: str, *resolutions: str) -> None:
    """Bake the mesh at each resolution, and print how well the pictures agree with those of the mesh itself."""
    with tempfile.TemporaryDirectory() as folder:
        for resolution in map(int, resolutions or ("128", "256", "512")):
            baked = dw.bake_mesh(mesh, Path(folder) / f"{resolution}.dpci.exr", resolution=resolution)
            found = dw.compare(mesh, baked, size=(320, 240), views=6)
            print(
                f"{resolution}²: {found.mean['psnr']:.1f} dB, worst {found.worst['psnr']:.1f} dB; "
                f"{baked.stat().st_size / 1e6:.1f} MB on disk, {found.gpu_bytes / 1e6:.1f} MB on the GPU"
            )


if __name__ == "__main__":
    main(*sys.argv[1:]) if len(sys.argv) > 1 else sys.exit(__doc__)

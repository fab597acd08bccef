"""Input files for tests."""

from pathlib import Path

from depthwalk.ingest.mesh import Mesh


def written(path: Path, data: bytes | str) -> Path:
    """Stores `data`, text in UTF-8, as the file `path`."""
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


def write_ply(path: Path, mesh: Mesh) -> Path:
    """Stores positions, normals and faces as a text PLY file."""
    columns = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    rows = [" ".join(f"{value:.9g}" for value in (*p, *n)) for p, n in zip(mesh.positions, mesh.normals, strict=True)]
    rows += [f"3 {a} {b} {c}" for a, b, c in mesh.faces]
    path.write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(mesh.positions)}\n{columns}"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n" + "\n".join(rows) + "\n"
    )
    return path

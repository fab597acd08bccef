"""Meshes in poses taken by chance."""

from pathlib import Path

import numpy as np
import pytest
from tools.pose_models import posed

from depthwalk.ingest.loader import load_mesh
from files import write_ply
from shapes import box


def test_a_posed_mesh_is_turned_and_a_metre_long(tmp_path: Path) -> None:
    write_ply(tmp_path / "box.ply", box(3.0, 2.0, 1.0))
    upright, one, two = load_mesh(tmp_path / "box.ply"), posed(tmp_path / "box.ply", 1), posed(tmp_path / "box.ply", 2)
    for model in one, two:
        assert len(model.faces) == 12
        assert np.ptp(model.positions, axis=0).max() == pytest.approx(1, abs=1e-5)
        assert model.positions[:, 1].min() == pytest.approx(0, abs=1e-6)
        edges = np.linalg.norm(np.diff(model.positions[model.faces], axis=1), axis=2)
        before = np.linalg.norm(np.diff(upright.positions[upright.faces], axis=1), axis=2)
        assert edges / before == pytest.approx(np.full(edges.shape, edges[0, 0] / before[0, 0]), rel=1e-4)
    assert not np.allclose(one.positions, two.positions, atol=1e-2)

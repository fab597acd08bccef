import pytest

from depthwalk.quality import dof
from depthwalk.scene.loader import load_scene


@pytest.fixture
def blurred(tiny_scene):
    """The ball, far behind the focus of a wide lens."""
    lens = {"focal_length": "400", "f_number": "1.4", "largest": "25"}
    return load_scene(tiny_scene, overrides={f"render.dof.{key}": value for key, value in lens.items()})


def test_modes_are_measured_against_many_frames(blurred, monkeypatch, gl_device):
    monkeypatch.setattr(dof, "TRUTH", 24)
    rows, pictures = dof.examine(blurred, (80, 60), 2.0)
    none, _, gather, truth = rows
    assert [row.mode for row in rows] == list(dof.MODES) == list(pictures)
    assert truth.psnr == float("inf") and truth.flip == 0
    assert none.psnr + 3 < gather.psnr < 60
    assert gather.flip < none.flip and none.changed == 0
    assert truth.seconds > max(none.seconds, gather.seconds)


def test_what_is_in_the_middle_is_in_focus(blurred, monkeypatch, gl_device):
    monkeypatch.setattr(dof, "TRUTH", 4)
    rows, _ = dof.examine(blurred, (80, 60), None)
    assert blurred.render.dof.focus_distance == pytest.approx(3, abs=0.02)  # the ball's near side
    assert rows[2].changed <= 1


def test_a_table_has_a_row_per_scene_and_mode():
    rows = [dof.Row("gather", 40.04, 0.0123, 1, 0.02), dof.Row("accumulate", float("inf"), 0.0, 0, 1.0)]
    lines = dof.to_markdown({"room": rows}).splitlines()
    assert lines[2] == "| room | `gather` | 40.0 | 0.0123 | 1 | 20 | 1/50 |"
    assert len(lines) == 4 and len({line.count("|") for line in lines}) == 1

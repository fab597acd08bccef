"""Table 2 of the paper is measured again by one command."""

import pytest

from tools import rivals


@pytest.mark.slow
@pytest.mark.gl
def test_each_view_has_a_row_for_each_way(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rivals, "VIEWS", {"aside": 40.0})
    rivals.main(["--side", "64", "--frames", "1", "--size", "96", "72"])
    rows = [line.split("|")[1:-1] for line in capsys.readouterr().out.splitlines() if line.startswith("| `")]
    assert [row[0].strip(" `") for row in rows] == list(rivals.WAYS)
    passes, psnr = ({row[0].strip(" `"): float(row[k]) for row in rows} for k in (1, 7))
    assert min(passes.values()) > 0
    assert psnr["bump"] < psnr["parallax"] < psnr["relief"] <= psnr["relief, 100 steps"] and psnr["displacement"] > 25

"""The headers of baked files; damage of whole files is tested in test_file.py."""

from pathlib import Path

import pytest

from depthwalk import limits
from depthwalk.bake.header import check_entries, first_line, inspect_header
from depthwalk.errors import InputError


def test_entries_have_a_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "MAX_BOUNDARY_STRIP_ENTRIES", 10)
    check_entries(tmp_path / "x", 10)
    with pytest.raises(InputError, match="x: boundary strips of 11 entries; at most 10 are allowed"):
        check_entries(tmp_path / "x", 11)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.exr: no such file"):
        inspect_header(tmp_path / "none.exr")


@pytest.mark.parametrize("error, line", [(ValueError(" one\ntwo"), "one"), (KeyError(), "KeyError")])
def test_errors_are_told_in_one_line(error: KeyError | ValueError, line: str) -> None:
    assert first_line(error) == line

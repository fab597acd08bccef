"""Files named by URLs appear whole."""

from pathlib import Path

import pytest
from fsspec.implementations.memory import MemoryFileSystem

from depthwalk.cluster.store import check_url, fetch_file, is_url, read_head, send_file, write_url
from depthwalk.errors import InputError


@pytest.mark.parametrize(
    ("name", "is_one"),
    [("s3://b/f.png", True), ("memory://f", True), ("a/b.png", False), ("C:/f.png", False), ("-", False)],
)
def test_what_is_a_url(name: str, is_one: bool) -> None:
    assert is_url(name) == is_one


@pytest.mark.parametrize("folder", ["file", "memory"])
def test_a_file_is_replaced_and_nothing_is_left_beside_it(folder: str, tmp_path: Path) -> None:
    base = f"file://{tmp_path}" if folder == "file" else "memory://farm"
    url = f"{base}/f 1.bin"
    assert read_head(url, 4) == b""
    write_url(url, b"old")
    write_url(url, b"newer")
    assert read_head(url, 3) == b"new" and read_head(url, 99) == b"newer"
    if folder == "file":
        assert [path.name for path in tmp_path.iterdir()] == ["f 1.bin"]
    else:
        assert MemoryFileSystem().ls("/farm", detail=False) == ["/farm/f 1.bin"]


def test_what_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fsspec.implementations.local import LocalFileSystem

    def fail(*names: object) -> None:
        raise OSError("no space")

    url = f"file://{tmp_path}/f.bin"
    write_url(url, b"old")
    monkeypatch.setattr(LocalFileSystem, "mv", fail)
    with pytest.raises(OSError, match=r"^file://.*f\.bin: cannot be written: no space$"):
        write_url(url, b"new")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"f.bin": b"old"}


@pytest.mark.parametrize("base", ["file://{d}", "memory://store"])
def test_files_are_sent_and_fetched(base: str, tmp_path: Path) -> None:
    url, file = base.format(d=tmp_path) + "/stored.bin", tmp_path / "own.bin"
    assert not fetch_file(url, file) and not file.exists()
    for data in (b"first", b"then"):
        file.write_bytes(data)
        send_file(file, url)
        file.unlink()
        assert fetch_file(url, file) and file.read_bytes() == data


def test_a_folder_that_is_missing_is_the_users_to_make(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none/f\.bin: cannot be written: No such file or directory$"):
        send_file(Path(__file__), f"file://{tmp_path}/none/f.bin")


def test_a_protocol_without_driver_is_refused() -> None:
    with pytest.raises(InputError, match=r"^nowhere://a/f\.png: "):
        check_url("nowhere://a/f.png")

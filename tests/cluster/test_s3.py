"""Files in an object store that speaks S3, where its libraries are installed: pip install s3fs "moto[s3,server]"."""

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from depthwalk.cluster.store import fetch_file, read_head, send_file, write_url
from depthwalk.errors import InputError

pytest.importorskip("s3fs")
server = pytest.importorskip("moto.server")


@pytest.fixture
def bucket(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    import fsspec

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    running = server.ThreadedMotoServer("127.0.0.1", port, verbose=False)
    running.start()
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.setenv(name, "testing")
    monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
    monkeypatch.setitem(fsspec.config.conf, "s3", {"endpoint_url": f"http://127.0.0.1:{port}"})
    fsspec.filesystem("s3").makedirs("models", exist_ok=True)
    yield "s3://models"
    running.stop()


def test_a_file_appears_whole_and_alone(bucket: str, tmp_path: Path) -> None:
    import fsspec

    url, file = f"{bucket}/a/f.bin", tmp_path / "f.bin"
    assert read_head(url, 4) == b"" and not fetch_file(url, file)
    write_url(url, b"old")
    file.write_bytes(b"newer")
    send_file(file, url)
    file.unlink()
    assert fetch_file(url, file) and file.read_bytes() == b"newer" and read_head(url, 3) == b"new"
    assert fsspec.filesystem("s3").find("models") == ["models/a/f.bin"]


def test_a_bucket_that_is_missing_is_the_users_to_make(bucket: str) -> None:
    with pytest.raises(InputError, match=r"^s3://none/f\.bin: cannot be written: The specified bucket does not exist$"):
        write_url("s3://none/f.bin", b"")

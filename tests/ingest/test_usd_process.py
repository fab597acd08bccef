"""USD files in the process that translates them."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.usd import translation
from depthwalk.ingest.watched_process import Answer
from usd_files import mesh, translate_here, write_usda, xform


@pytest.fixture
def _library() -> None:
    pytest.importorskip("pxr", reason="usd-core is not installed")


@pytest.mark.slow
@pytest.mark.usefixtures("_library")
def test_a_process_reads_binary_files_and_tells_where_they_end(tmp_path: Path) -> None:
    from pxr import Usd

    stage = Usd.Stage.Open(str(write_usda(tmp_path / "text.usda", xform("World", mesh()))))
    binary = tmp_path / "scene.usdc"
    stage.Export(str(binary))
    assert len(read_soup(binary).faces) == 4
    binary.write_bytes(binary.read_bytes()[:-200])
    with pytest.raises(InputError, match="possibly truncated"):
        read_soup(binary)


@pytest.mark.slow
@pytest.mark.usefixtures("_library")
def test_a_process_that_takes_too_much_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_usda(tmp_path / "a.usda", xform("World", mesh()))
    monkeypatch.setattr(translation, "_BYTES", 1 << 20)
    with pytest.raises(InputError, match=r"a\.usda: damaged, or too large: it takes too much memory to read"):
        read_soup(path)


@pytest.mark.usefixtures("_library")
def test_a_translation_is_kept_until_a_file_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    translate_here(monkeypatch)
    write_usda(tmp_path / "part.usda", xform("World", mesh()))
    path = write_usda(tmp_path / "a.usda", xform("World", terms="references = @./part.usda@"))
    first = translation.translated(path)
    with monkeypatch.context() as patch:
        patch.setattr(translation, "run_watched", None)
        assert translation.translated(path) is first
    write_usda(tmp_path / "part.usda", xform("World", mesh(), mesh("other")))
    assert len(translation.translated(path)) > len(first)


@pytest.mark.usefixtures("_library")
def test_a_file_that_is_written_while_it_is_read_is_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    translate_here(monkeypatch)
    path = write_usda(tmp_path / "a.usda", xform("World", mesh()))
    run = vars(translation)["run_watched"]  # in this process

    def written_meanwhile(*request: Any, **limits: Any) -> Answer:
        answer = run(*request, **limits)
        write_usda(path, xform("World", mesh(), mesh("other")))
        return answer

    with monkeypatch.context() as patch:
        patch.setattr(translation, "run_watched", written_meanwhile)
        before = translation.translated(path)
    assert len(translation.translated(path)) > len(before)


def test_without_the_library_its_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(translation, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"`pip install .*usd.*` installs what reads USD files"):
        read_soup(write_usda(tmp_path / "a.usda", xform("World", mesh())))


@pytest.mark.slow
def test_other_files_import_nothing_of_it() -> None:
    code = "import sys, depthwalk.ingest.reader, depthwalk.ingest.mesh_head\nprint('pxr' in sys.modules)"
    code += "\nprint(any(name.startswith('depthwalk.ingest.usd') for name in sys.modules))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["False", "False"]

"""Rows of Radiance pictures decoded at once are those that are decoded one by one."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.ingest import radiance_hdr
from depthwalk.ingest.radiance_hdr import read_radiance
from depthwalk.ingest.rgbe_rows import coded_rows, row_marker

HEIGHT, WIDTH = 40, 300
RNG = np.random.default_rng(3)


def coded(row: np.ndarray) -> bytes:
    """Code a row (4, W) as a marker, and each channel as runs of random lengths, equal bytes or not."""
    data = row_marker(row.shape[1])
    for channel in row:
        at = 0
        while at < len(channel):
            rest = channel[at:]
            equal = int(np.argmax(np.append(rest != rest[0], True)))
            is_run = equal > 2
            count = min(equal, 127) if is_run else min(int(RNG.integers(1, 129)), len(rest))
            data += bytes([128 + count, rest[0]]) if is_run else bytes([count]) + rest[:count].tobytes()
            at += count
    return data


def picture(rows: list[bytes], width: int = WIDTH) -> bytes:
    return b"#?RADIANCE\n\n-Y %d +X %d\n" % (len(rows), width) + b"".join(rows)


def pixels(width: int = WIDTH) -> np.ndarray:
    """Random rows (H, 4, W), half of them with long runs, and with what looks like the beginning of a row in others."""
    values = RNG.integers(0, 256, (HEIGHT, 4, width), np.uint8)
    values[::2] = np.repeat(RNG.integers(0, 256, (HEIGHT // 2, 4, width // 20 + 1), np.uint8), 20, axis=2)[..., :width]
    values[5, 1, 40:44] = values[7, 3, 100:104] = np.frombuffer(row_marker(width), np.uint8)
    return values


def one_by_one(file: Path, monkeypatch: pytest.MonkeyPatch) -> np.ndarray:
    with monkeypatch.context() as context:
        context.setattr(radiance_hdr, "coded_rows", lambda *_: None)
        return read_radiance(file)


@pytest.mark.parametrize("width", [WIDTH, 8, 514, 9000])
def test_rows_decoded_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    """Row 514 begins with four equal bytes, whose parts look like a beginning, too."""
    values = pixels(max(width, 120))[..., :width]
    data = picture([coded(row) for row in values], width)
    found = coded_rows(data, data.index(b"X ") + len(f"X {width}\n"), HEIGHT, width)
    assert found is not None and (found.decoded(slice(0, HEIGHT)) == values).all()
    (file := tmp_path / "sky.hdr").write_bytes(data)
    assert (read_radiance(file) == one_by_one(file, monkeypatch)).all()


def test_rows_of_both_kinds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [coded(row) if number % 3 else row.T.tobytes() for number, row in enumerate(pixels())]
    (file := tmp_path / "sky.hdr").write_bytes(picture(rows))
    assert read_radiance(file).any() and (read_radiance(file) == one_by_one(file, monkeypatch)).all()


def test_a_file_made_of_beginnings_is_read_row_by_row(tmp_path: Path) -> None:
    """Following all of these would take long."""
    marker = row_marker(WIDTH)
    row = marker + (bytes([100]) + marker * 25) * 12
    data = picture([row] * HEIGHT)
    assert coded_rows(data, data.index(marker), HEIGHT, WIDTH) is None
    (file := tmp_path / "sky.hdr").write_bytes(data)
    assert read_radiance(file).shape == (HEIGHT, WIDTH, 3)


@pytest.mark.parametrize(
    ("number", "end", "message"), [(7, None, "a run is empty"), (HEIGHT - 1, -200, "the file ends within it")]
)
def test_damage_in_the_midst_is_located(tmp_path: Path, number: int, end: int | None, message: str) -> None:
    rows = [coded(row) for row in pixels()]
    if end is None:
        rows[number] = rows[number][:4] + b"\0" + rows[number][5:]
    (file := tmp_path / "sky.hdr").write_bytes(picture(rows)[:end])
    with pytest.raises(InputError, match=f"row {number} of {HEIGHT}: {message}$"):
        read_radiance(file)

"""How large the atlas of impostor tiles is."""

import pytest

from depthwalk.render import tile_atlas
from depthwalk.render.tile_atlas import atlas_size


@pytest.mark.parametrize(
    ("picture", "limit", "expected"),
    [
        ((160, 120), 16384, (4096, 2048)),
        ((1920, 1080), 16384, (4096, 2048)),
        ((2000, 1200), 16384, (4096, 4096)),
        ((3840, 2160), 16384, (8192, 4096)),
        ((7680, 4320), 16384, (16384, 8192)),
        ((3840, 2160), 4096, (4096, 4096)),
    ],
)
def test_an_atlas_holds_four_pictures_in_powers_of_two(
    monkeypatch: pytest.MonkeyPatch, picture: tuple[int, int], limit: int, expected: tuple[int, int]
) -> None:
    """Never less than the program's smallest, in place of which tests have a smaller one; nor more than GPUs allow."""
    monkeypatch.setattr(tile_atlas, "ATLAS_TEXELS", 1 << 23)
    assert atlas_size(picture, limit) == expected


def test_in_tests_the_smallest_is_a_megatexel() -> None:
    """So large that pictures of tests have more room than those of the program."""
    assert atlas_size((320, 240), 16384) == (1024, 1024)

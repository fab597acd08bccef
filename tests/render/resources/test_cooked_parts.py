"""Parts of assets have numbers of their own, which stay."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from depthwalk.cook.cook import CookOptions
from depthwalk.render.resources.cooked_parts import CookedParts
from depthwalk.render.resources.library import Library


class TwoParts:
    """Three assets of two parts each, whose arrays may be lost; it notes what is asked of it."""

    def __init__(self) -> None:
        self.asked: list[tuple[int, bool]] = []
        self.lost = False

    def __len__(self) -> int:
        return 3

    def cooked(self, asset: int, options: CookOptions, *, again: bool = False) -> tuple[Any, ...]:
        self.asked.append((asset, again))

        def load(part: int) -> tuple[str, str]:
            if self.lost and not again:
                raise OSError("lost")
            return f"geometry {asset}.{part}", f"texture {asset}.{part}"

        return tuple(SimpleNamespace(load=lambda part=part: load(part)) for part in range(2))

    def baked(self, asset: int) -> None:
        return None


@pytest.fixture
def library() -> TwoParts:
    return TwoParts()


@pytest.fixture
def parts(library: TwoParts) -> CookedParts:
    return CookedParts(cast(Library, library))


def test_numbers_follow_those_of_assets_in_the_order_in_which_they_are_asked_for(
    parts: CookedParts, library: TwoParts
) -> None:
    assert len(parts) == parts.first == 3 and not parts.knows(2)
    assert [parts.numbers(asset) for asset in (2, 0, 2)] == [range(3, 5), range(5, 7), range(3, 5)]
    assert len(parts) == 7 and parts.knows(2) and not parts.knows(1)
    assert [parts.asset_of(number) for number in range(3, 7)] == [2, 2, 0, 0]
    assert library.asked == [(2, False), (0, False)]


def test_numbers_outlast_what_was_cooked(parts: CookedParts, library: TwoParts) -> None:
    parts.numbers(1)
    parts.forget()
    assert parts.numbers(1) == range(3, 5) and library.asked == [(1, False)]
    assert cast(Any, parts.load(4)) == ("geometry 1.1", "texture 1.1")
    assert library.asked == [(1, False)] * 2


def test_what_the_cache_has_lost_is_cooked_again(parts: CookedParts, library: TwoParts) -> None:
    parts.numbers(0)
    library.lost = True
    assert cast(Any, parts.load(4)) == ("geometry 0.1", "texture 0.1")
    assert library.asked == [(0, False), (0, True)]
    parts.load(3)  # from what was cooked again
    assert len(library.asked) == 2


def test_depth_images_that_are_gone_are_an_error(parts: CookedParts) -> None:
    with pytest.raises(LookupError, match="asset 1 has no depth images"):
        parts.baked(parts.numbers(1)[0])

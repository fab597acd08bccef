"""Sizes as users write them, and what is too much for this machine."""

import pytest

from depthwalk import budget, limits
from depthwalk.budget import cache_limit, check_memory, machine_memory, parse_size
from depthwalk.errors import InputError

SIZES = {"0": 0, "1000": 1000, "1.5kB": 1500, "500MB": 500 * 10**6, "4 GiB": 4 << 30, "2g": 2 * 10**9, "1TiB": 1 << 40}


@pytest.mark.parametrize("text", SIZES)
def test_sizes(text: str) -> None:
    assert parse_size(text, "--cache-limit") == SIZES[text]


@pytest.mark.parametrize("text", ["", "-1", "1e9", "much", "1 2", "4PB", "nan", "9999999999", "٣MB"])
def test_what_is_no_size(text: str) -> None:
    with pytest.raises(InputError, match=r"must be a size such as 500MB or 4GB$"):
        parse_size(text, "--cache-limit")


def test_the_environment_limits_the_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(budget.CACHE_LIMIT, raising=False)
    assert cache_limit() == limits.MAX_CACHE_BYTES
    monkeypatch.setenv(budget.CACHE_LIMIT, "3MB")
    assert cache_limit() == 3_000_000
    monkeypatch.setenv(budget.CACHE_LIMIT, "three")
    with pytest.raises(InputError, match=r"^DEPTHWALK_CACHE_LIMIT three: must be a size"):
        cache_limit()


def test_memory_is_that_of_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    assert machine_memory() > 1 << 28
    check_memory("a", 1 << 28, "little")
    with pytest.raises(InputError, match=r"^a: much would take 1125899907 MB of memory; \d+ MB are allowed here$"):
        check_memory("a", 1 << 50, "much")

"""The manners of every command, as far as they can be tried without a process of its own."""

import gc

import pytest

from depthwalk.commands.program import without_garbage


def test_garbage_is_looked_for_again_after_the_start_even_if_that_fails() -> None:
    frozen = gc.get_freeze_count()
    with pytest.raises(ValueError, match="scene"), without_garbage():
        assert not gc.isenabled()
        raise ValueError("scene")
    assert gc.isenabled() and gc.get_freeze_count() > frozen
    gc.unfreeze()

"""The names of parts and channels of baked files."""

import numpy as np
import pytest

from depthwalk.bake.file_layout import CHANNELS, channel_names, channel_type, is_list, split_name


@pytest.mark.parametrize(
    "name, number, rest",
    [
        ("side.0", 0, "side.0"),
        ("part1.side.0", 0, "side.0"),
        ("part12.border.top.3", 11, "border.top.3"),
        ("part0.side.0", 0, "part0.side.0"),  # not one of ours: refused by its rest
        ("", 0, ""),
    ],
)
def test_names_say_which_object_a_part_is_of(name: str, number: int, rest: str) -> None:
    assert split_name(name) == (number, rest)


@pytest.mark.parametrize("steps, pairs", [(1, 1), (2, 1), (3, 2), (7, 4)])
def test_two_grids_share_a_channel(steps: int, pairs: int) -> None:
    names = channel_names("part2.side.0", steps)
    assert names[: len(CHANNELS)] == CHANNELS and len(names) == len(CHANNELS) + pairs


def test_lists_are_told_from_images() -> None:
    assert is_list("border.side.0") and is_list("part3.triangles.top.1") and not is_list("part3.top.1")
    assert channel_names("border.side.0", 7) == ("start", "du", "dv", "rise", "used")
    assert channel_names("part1.triangles.side.0", 7) == ("a", "b", "c", "used")


@pytest.mark.parametrize("channel, dtype", [("Z", np.float32), ("R", np.float16), ("cells.3", np.uint32)])
def test_channels_have_one_type_each(channel: str, dtype: type[np.float16] | type[np.float32]) -> None:
    assert channel_type(channel) is dtype

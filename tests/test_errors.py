"""Help with misspelt words."""

from depthwalk.errors import suggest


def test_the_closest_word_is_suggested() -> None:
    assert suggest("colour_", ["colour", "collar", "floor"]) == "; did you mean 'colour'?"


def test_nothing_is_suggested_where_nothing_is_close() -> None:
    assert suggest("xyz", ["colour", "floor"]) == suggest("colour", []) == ""

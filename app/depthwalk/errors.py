"""The one exception that means "the user's input is wrong"."""


class InputError(Exception):
    """What the user gave cannot be used; the message says where and why, in one line.

    The command line prints the message without a traceback and exits with code 2.
    """


def suggest(word: str, choices: "list[str]") -> str:
    """`; did you mean 'x'?` for the choice closest to `word`, or an empty string."""
    from difflib import get_close_matches

    close = get_close_matches(word, choices, n=1, cutoff=0.6)
    return f"; did you mean {close[0]!r}?" if close else ""

"""Define the one exception that means "the user's input is wrong", and help with misspelt words."""

from collections.abc import Iterable
from difflib import get_close_matches


class InputError(Exception):
    """Report that what the user gave cannot be used; the message says where and why, in one line.

    The command line prints the message without a traceback and exits with code 2.
    """


def suggest(word: str, choices: Iterable[str]) -> str:
    """Return the end of an error message, `; did you mean 'x'?`, that helps whoever misspelt a word.

    Parameters
    ----------
    word
        The word that was given.
    choices
        The words that would be right; the one spelt most like `word` is named.

    Returns
    -------
    str
        The end of the message; "" where no choice resembles the word.
    """
    close = get_close_matches(word, list(choices), n=1, cutoff=0.6)
    return f"; did you mean {close[0]!r}?" if close else ""

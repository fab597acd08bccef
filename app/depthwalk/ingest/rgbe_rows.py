"""Decode scan lines of Radiance pictures that are coded as runs, many at once.

Where a run begins is known only once the one before it is. So all rows are followed side by side, one run of each at a
time. Where a row begins is not known either, but each begins with the same four bytes. What has these by chance is not
reached from the row before.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CHANNELS = 4
"""Red, green, blue and exponent, one after the other in a coded row."""
CODED = range(8, 1 << 15)
"""Widths whose rows may be coded as runs; a marker holds 15 bits."""
LONGEST_RUN = 127

_MARKER_BYTES = 4
_MAX_STARTS = 2  # per row, of places that look as if they began one; a file with more was made to take long
_TOO_LONG = 1 << 40  # stands for the length of an empty run, so that it is found as those that are too long for a row
_CODES = np.arange(256)
_IS_RUN = _CODES > LONGEST_RUN + 1  # of equal bytes; others are as many bytes as the code says
_LENGTHS = np.where(_CODES == 0, _TOO_LONG, np.where(_IS_RUN, _CODES - LONGEST_RUN - 1, _CODES))
_STEPS = np.where(_IS_RUN, 2, _CODES + 1)  # from a code to the next
_REPEATS = np.where(_IS_RUN, _LENGTHS, 1).astype(np.uint8)  # of the byte after a code

_Places = NDArray[np.int64]


def row_marker(width: int) -> bytes:
    """Return the bytes that each coded row of a picture begins with."""
    return bytes([2, 2, width >> 8, width & 255])


@dataclass(frozen=True, kw_only=True)
class CodedRows:
    """Hold the rows of a picture, all coded as runs."""

    data: NDArray[np.uint8]
    """The contents of the file, (B,)."""
    places: _Places
    """Where each row begins and the last one ends, (H + 1,)."""
    repeats: NDArray[np.uint8]
    """How often each byte of the file occurs in the decoded rows, (B,); of what is in no row it says nothing."""
    width: int
    """Pixels in a row."""

    def decoded(self, rows: slice) -> NDArray[np.uint8]:
        """Return some consecutive rows, (rows, CHANNELS, width) uint8."""
        first, after, _ = rows.indices(len(self.places) - 1)
        part = slice(self.places[first], self.places[after])
        return np.repeat(self.data[part], self.repeats[part]).reshape(-1, CHANNELS, self.width)


def coded_rows(data: bytes, start: int, height: int, width: int) -> CodedRows | None:
    """Find the rows of a picture.

    Parameters
    ----------
    data
        The contents of the file.
    start
        Where the first row begins.
    height, width
        Size of the picture, in pixels.

    Returns
    -------
    CodedRows or None
        The rows; None if any is not coded or damaged. Rows can then be read one by one, which tells what is wrong.
    """
    if width not in CODED or (starts := _marked(data, start, height, row_marker(width))) is None:
        return None
    values = np.frombuffer(data, np.uint8)
    ends, repeats = _followed(values, starts, width)
    following = dict(zip(starts.tolist(), ends.tolist(), strict=True))
    places = [start]
    while len(places) <= height and (end := following.get(places[-1], -1)) >= 0:
        places.append(end)
    if len(places) <= height:
        return None
    found = np.array(places)
    if len(starts) > height:  # the others were followed as well, and have marked bytes of true rows
        repeats = _followed(values, found[:-1], width)[1]
    return CodedRows(data=values, places=found, repeats=repeats, width=width)


def _marked(data: bytes, start: int, height: int, marker: bytes) -> _Places | None:
    """Return where rows may begin, in ascending order; None if there are too few or far too many such places."""
    places: list[int] = []
    place = data.find(marker, start)
    while place >= 0 and len(places) <= _MAX_STARTS * height:
        places.append(place)
        place = data.find(marker, place + 1)
    return np.array(places) if height <= len(places) <= _MAX_STARTS * height else None


def _followed(data: NDArray[np.uint8], starts: _Places, width: int) -> tuple[_Places, NDArray[np.uint8]]:
    """Follow rows from code to code, all side by side.

    Returns
    -------
    tuple
        Where each row ends, (n,), -1 where that cannot be; and how often each byte of the file occurs when all these
        rows are decoded, (B,) uint8.
    """
    repeats, ends = np.ones(len(data), np.uint8), np.full(len(starts), -1)
    for byte in range(_MARKER_BYTES):
        repeats[starts + byte] = 0
    place, row = starts + _MARKER_BYTES, np.arange(len(starts))
    missing, channel = np.full(len(starts), width), np.zeros(len(starts), np.int64)
    last = len(data) - 2  # place of the last code that has a byte after it
    while True:
        if place.max() > last or missing.min() <= 0:
            missing, channel = np.where(missing == 0, width, missing), channel + (missing == 0)
            is_whole = (channel == CHANNELS) & (place <= len(data))
            ends[row[is_whole]] = place[is_whole]
            goes_on = (channel < CHANNELS) & (missing > 0) & (place <= last)
            place, row, missing, channel = (column[goes_on] for column in (place, row, missing, channel))
            if not len(row):
                return ends, repeats
        code = data[place]
        repeats[place], repeats[place + 1] = 0, _REPEATS[code]
        place, missing = place + _STEPS[code], missing - _LENGTHS[code]

"""Change bytes and lines of text at random, whatever they mean."""

import random
import re
import struct

Data = bytes

_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
NUMBERS = (b"0", b"-1", b"1", b"2", b"3", b"255", b"65535", b"65536", b"1e-30", b"1e30", b"1e308", b"1e400", b"-1e39",
           b"2147483647", b"4294967296", b"9223372036854775807", b"9223372036854775808", b"-9223372036854775808",
           b"99999999999999999999999", b"nan", b"inf", b"-inf", b"0x10", b"1_0", b"1.5", b".5", b"5.", b"-0.0",
           b"")  # fmt: skip
_INTEGERS = (0, 1, 2, 3, 7, 8, 16, 127, 128, 255, 256, 1024, 4096, 32767, 32768, 65535, 65536, 2**24, 2**31 - 1, 2**31,
             2**32 - 1, 2**32, 2**63 - 1, 2**64 - 1)  # fmt: skip
_FLOATS = (0.0, -0.0, 1.0, -1.0, 1e-38, 1e30, 3e38, float("nan"), float("inf"), float("-inf"))
_LONGEST = 1 << 16


def span(data: Data, rng: random.Random) -> tuple[int, int]:
    """Return start and end of a part of `data`, mostly a short one."""
    start = rng.randrange(len(data) + 1)
    length = min(int(2 ** rng.uniform(0, 1 + max(len(data), 1).bit_length())), len(data) - start)
    return start, start + length


def change_bytes(data: Data, rng: random.Random, words: tuple[bytes, ...] = ()) -> Data:
    """Return `data` with a bit flipped, a byte set, a part left out, doubled, moved or replaced, a word put in."""
    start, end = span(data, rng)
    match rng.randrange(9 if words else 8):
        case 0 if data:
            at = rng.randrange(len(data))
            return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]
        case 1 if data:
            at = rng.randrange(len(data))
            return (
                data[:at] + bytes([rng.choice((0, 1, 10, 32, 47, 127, 128, 255, rng.randrange(256)))]) + data[at + 1 :]
            )
        case 2:
            return data[:start] + data[end:]
        case 3:
            return data[:end] + data[start:end] * rng.choice((1, 1, 2, 16, 256)) + data[end:]
        case 4:
            return data[:start]
        case 5:
            return data[:start] + rng.randbytes(end - start) + data[end:]
        case 6:
            packed = _packed(rng)
            return data[:start] + packed + data[start + len(packed) :]
        case 7:
            to = rng.randrange(len(data) + 1)
            return data[:to] + data[start:end] + data[to + (end - start) * rng.randrange(2) :]
    word = rng.choice(words or (b"",))
    return data[:start] + word + data[start + len(word) * rng.randrange(2) :]


def _packed(rng: random.Random) -> Data:
    order = rng.choice("<>")
    if rng.random() < 0.3:
        return struct.pack(
            order + rng.choice("fd"), rng.choice(_FLOATS[:6] + _FLOATS[7:]) if rng.random() < 0.5 else 1.0
        )
    width = rng.choice("HIQ")
    return struct.pack(order + width, rng.choice(_INTEGERS) % (1 << 8 * struct.calcsize(width)))


def change_text(data: Data, rng: random.Random, words: tuple[bytes, ...] = ()) -> Data:
    """Return `data` with a number replaced, or a line left out, doubled, moved, or cut, or a word put in."""
    lines = data.split(b"\n")
    at = rng.randrange(len(lines))
    match rng.randrange(7):
        case 0 | 1:
            numbers = list(_NUMBER.finditer(data))
            if not numbers:
                return change_bytes(data, rng, words)
            number = rng.choice(numbers)
            return data[: number.start()] + rng.choice(NUMBERS) + data[number.end() :]
        case 2:
            del lines[at]
        case 3:
            lines.insert(rng.randrange(len(lines) + 1), lines[at])
        case 4:
            lines[at : at + 1] = [lines[at]] * rng.choice((2, 16, 300))
        case 5:
            columns = lines[at].split(b" ")
            column = rng.randrange(len(columns))
            columns[column : column + 1] = rng.choice(([], [columns[column]] * 2, [b"", columns[column]], [b"x"]))
            lines[at] = b" ".join(columns)
        case _:
            line = lines[at]
            place = rng.randrange(len(line) + 1)
            lines[at] = (
                line[:place] + rng.choice((*words, *NUMBERS, b"\\", b"#", b"\t", b"\r", b"\x1b[2J")) + line[place:]
            )
    return b"\n".join(lines)


def bounded(data: Data) -> Data:
    """Return `data`, cut where it has become long: many short files find more than a few long ones."""
    return data[:_LONGEST]

"""Changes that make a sound input hostile: odd numbers, torn bytes, JSON and text with one thing wrong."""

import copy
import json
import random
import re
from pathlib import Path

#: Numbers that a size or a time may be replaced by. Python writes NaN and Infinity as such.
NUMBERS = (
    0, -1, 1, 2, 3, 7, 1000, 65_537, 10**6, 10**9, 2**31, 2**32, 2**40, 10**18, 2**53, 2**62, 2**63 - 1, 2**63,
    2**64 - 1, 2**64, 10**30, -(2**63), 0.5, -0.0, 1e-300, 5e-324, 1e-30, 1e30, 1e300, 1.7e308, -1e300,
    float("nan"), float("inf"), float("-inf"),
)  # fmt: skip
#: What an unsigned number of a size may be, and what it must not be believed to be.
SIZES = (
    0, 1, 2, 3, 5, 17, 100, 4095, 4097, 65_535, 65_537, 10**6, 10**8, 10**9, 2**31, 2**32 - 1, 2**32, 2**40, 10**15,
    2**53, 10**18, 2**61, 2**62, 2**63 - 1, 2**63, 2**64 - 1,
)  # fmt: skip
REALS = (
    0.0, -0.0, -1.0, 0.5, 1.0, 1000.0, 1e-300, 5e-324, 1e-30, 1e-9, 1e9, 1e30, 1e38, 4e38, 1e300,
    1.7e308, -1e300, -1e-9,
)  # fmt: skip
TEXTS = (
    "",
    "x",
    "NaN",
    "inf",
    "-1",
    "1e999",
    "/dev/zero",
    "../../etc/passwd",
    "a\x00b",
    "\u202e",
    "é" * 40,
    "y" * 100_000,
)
OTHERS = (None, True, False, [], {}, [[]], [1], ["x"], {"x": 1}, [1e300] * 3, [0] * 5000)
#: As text, where a file holds numbers as words.
WORDS = tuple(repr(number) for number in NUMBERS) + ("nan", "inf", "-inf", "", "x", "0x10", "1e999", "1,5", "1 2")

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])")


def value(rng: random.Random, old: object = None) -> object:
    """An odd JSON value; more often than not of the kind that stands there, so that it gets past the first check."""
    if not isinstance(old, bool) and isinstance(old, int) and rng.random() < 0.7:
        return rng.choice(SIZES)
    if isinstance(old, float) and rng.random() < 0.7:
        return rng.choice(REALS)
    return copy.deepcopy(rng.choice(rng.choice((NUMBERS, NUMBERS, NUMBERS, TEXTS, OTHERS))))


def places(document: object, path: tuple = ()) -> list[tuple]:
    """Paths of every value of a JSON document. Of a long list the first few and the last."""
    found = [path] if path else []
    if isinstance(document, dict):
        for key in document:
            found += places(document[key], (*path, key))
    elif isinstance(document, list):
        for index in sorted({0, 1, len(document) - 1} & set(range(len(document)))):
            found += places(document[index], (*path, index))
    return found


def json_document(rng: random.Random, document: object, often: tuple[str, ...] = ()) -> object:
    """The document with one to three values replaced, removed or doubled; half the time below a key of `often`."""
    document = copy.deepcopy(document)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        every = places(document)
        wanted = [path for path in every if set(path) & set(often)]
        path = rng.choice(wanted if wanted and rng.random() < 0.5 else every)
        holder = document
        for key in path[:-1]:
            holder = holder[key]
        change = rng.random()
        if change < 0.1:
            del holder[path[-1]]
        elif change < 0.2 and isinstance(holder, list):
            holder.extend(copy.deepcopy(holder) * rng.choice((1, 1, 1000)))
        elif change < 0.25 and isinstance(holder, dict):
            holder[rng.choice(TEXTS)] = value(rng)
        else:
            holder[path[-1]] = value(rng, holder[path[-1]])
    return document


def json_bytes(rng: random.Random, document: object, often: tuple[str, ...] = ()) -> bytes:
    """A JSON file with something wrong in its values or, now and then, in its text."""
    whole = json.dumps(json_document(rng, document, often) if rng.random() < 0.9 else document)
    if rng.random() < 0.1:
        return torn(rng, whole.encode())
    if rng.random() < 0.03:
        return b"[" * 200_000
    return whole.encode("utf-8", "surrogatepass")


def torn(rng: random.Random, content: bytes) -> bytes:
    """Bytes cut short, flipped, doubled, shifted, or of another kind altogether."""
    content = bytearray(content)
    size = len(content)
    change = rng.randrange(9)
    if change == 0:
        del content[rng.randrange(size + 1) :]
    elif change == 1:
        for _ in range(rng.choice((1, 1, 5, 50))):
            content[rng.randrange(size)] ^= 1 << rng.randrange(8)
    elif change == 2:
        at = rng.randrange(size)
        content[at : at + rng.choice((1, 4, 8, 100))] = rng.randbytes(rng.choice((0, 1, 8, 64)))
    elif change == 3:
        # A size in the first bytes, or in the last, as archives have it.
        at = rng.choice((0, 4, 8, max(size - 22, 0), max(size - 12, 0), max(size - 6, 0)))
        content[at : at + 8] = rng.choice((2**64 - 1, 2**63, 2**40, 2**32 - 1, 0, size)).to_bytes(8, "little")
    elif change == 4:
        content = content + content
    elif change == 5:
        content = bytearray()
    elif change == 6:
        content = bytearray(rng.randbytes(rng.choice((1, 8, 100, 5000))))
    elif change == 7:
        content[:0] = b"\xef\xbb\xbf"
    else:
        content = bytearray(b"\0" * size)
    return bytes(content)


def text(rng: random.Random, whole: str) -> str:
    """A text with a number, a word or a line changed."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        change = rng.random()
        numbers = list(_NUMBER.finditer(whole))
        if change < 0.6 and numbers:
            one = rng.choice(numbers)
            whole = whole[: one.start()] + rng.choice(WORDS) + whole[one.end() :]
            continue
        lines = whole.split("\n")
        at = rng.randrange(len(lines))
        if change < 0.7:
            del lines[at]
        elif change < 0.8:
            lines[at:at] = [lines[rng.randrange(len(lines))]] * rng.choice((1, 1, 2000))
        elif change < 0.9:
            words = re.split(r"(\W+)", lines[at])
            words[rng.randrange(len(words))] = rng.choice(TEXTS)
            lines[at] = "".join(words)
        else:
            lines[at] = lines[at][: rng.randrange(len(lines[at]) + 1)]
        whole = "\n".join(lines)
    return whole


def put(path: Path, content: str | bytes) -> None:
    """Write a file; half a character of a text goes in as it is."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass"))


def in_json(rng: random.Random, path: Path, often: tuple[str, ...] = ()) -> None:
    """Change a file of JSON, as `json_bytes` does."""
    put(path, json_bytes(rng, json.loads(path.read_text()), often))

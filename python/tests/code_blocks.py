"""Fenced blocks of Markdown pages, with what a comment above them says."""

import re
from dataclasses import dataclass
from pathlib import Path

FENCE = re.compile(r"(?P<indent> {0,3})(?P<fence>`{3,})(?P<language>\w*)\s*")
NOT_RUN = re.compile(r"<!-- not run: (?P<reason>.+?) -->")


@dataclass(frozen=True)
class Block:
    """A block: its page, the line of its fence, its language (may be empty), its text, why it is not run."""

    page: Path
    line: int
    language: str
    text: str
    not_run: str | None

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"


def blocks(page: Path, text: str) -> list[Block]:
    """The fenced blocks of a page, in order."""
    found: list[Block] = []
    lines = text.split("\n")
    at = 0
    while at < len(lines):
        opening = FENCE.fullmatch(lines[at])
        if opening is None:
            at += 1
            continue
        end = at + 1
        closing = re.compile(f" {{0,3}}{opening['fence']}`*\\s*")
        while end < len(lines) and not closing.fullmatch(lines[end]):
            end += 1
        if end == len(lines):
            raise ValueError(f"{page}:{at + 1}: the block is not closed")
        above = NOT_RUN.search(lines[at - 1]) if at else None
        body = "".join(f"{line}\n" for line in lines[at + 1 : end])
        found.append(Block(page, at + 1, opening["language"], body, above["reason"] if above else None))
        at = end + 1
    return found

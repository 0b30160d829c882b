"""Links of pages to other sites: fetched, and what is not there is listed."""

import re
import urllib.error
import urllib.request
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

#: Links in Markdown, `<http...>`, and plain ones; without what ends a sentence.
_URL = re.compile(r"https?://[^\s<>()\[\]\"'`|]+(?:\([^\s()]*\)[^\s<>()\[\]\"'`|]*)*")
#: Statuses that say that there is no such page. Others (403, 429, 5xx) say nothing of the page.
GONE = (404, 410)
#: Seconds for an answer; links fetched at a time.
PATIENCE, AT_ONCE = 15.0, 8
#: Sites that answer programs otherwise than people.
AGENT = "Mozilla/5.0 (link check of hydro's documentation)"


@dataclass(frozen=True)
class Found:
    """links: page by link; gone: links whose page is not there; unknown: links without an answer, and why."""

    links: dict[str, str]
    gone: list[str] = field(default_factory=list)
    unknown: dict[str, str] = field(default_factory=dict)

    @property
    def is_offline(self) -> bool:
        """True where no link at all was answered."""
        return bool(self.links) and len(self.unknown) == len(self.links)

    def __str__(self) -> str:
        if self.is_offline:
            why = next(iter(self.unknown.values()))
            return f"no network: none of {len(self.links)} links to other sites was answered ({why}); not checked"
        lines = [
            f"{len(self.links)} links to other sites: {len(self.gone)} gone, {len(self.unknown)} without an answer"
        ]
        lines += [f"  gone: {link}  in {self.links[link]}" for link in self.gone]
        lines += [f"  no answer: {link}  in {self.links[link]}  ({why})" for link, why in self.unknown.items()]
        return "\n".join(lines)


def external(root: Path, pages: Iterable[str]) -> dict[str, str]:
    """Links to other sites: link -> the first page that has it. pages: paths relative to `root`."""
    found: dict[str, str] = {}
    for page in pages:
        if page.endswith((".md", ".py")):
            for link in _URL.findall((root / page).read_text(encoding="utf-8")):
                found.setdefault(link.rstrip(".,;:!?"), page)
    return {link: found[link] for link in sorted(found)}


def check(links: dict[str, str]) -> Found:
    """Fetch every link."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        answers = dict(zip(links, pool.map(_answer, links)))
    gone = [link for link, answer in answers.items() if answer in GONE]
    unknown = {link: str(answer) for link, answer in answers.items() if answer is not None and answer not in GONE}
    return Found(links, gone, unknown)


def _answer(link: str) -> int | str | None:
    """None where the page is there; else a status, or why there is no answer."""
    request = urllib.request.Request(link.partition("#")[0], headers={"User-Agent": AGENT})
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE):
            return None
    except urllib.error.HTTPError as error:
        return error.code
    except (OSError, ValueError) as error:
        return str(getattr(error, "reason", error)) or type(error).__name__

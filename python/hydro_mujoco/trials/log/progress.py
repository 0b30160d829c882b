"""A progress bar over a log, on a terminal and in a notebook; nothing in a file."""

import sys

from tqdm.auto import tqdm
from tqdm.std import tqdm as plain


def bar(total: int, unit: str, name: str) -> plain:
    """A bar that counts `total` units; `B` are bytes."""
    in_notebook = tqdm.__mro__[1].__module__ == "tqdm.notebook"
    return tqdm(
        total=total,
        unit=unit,
        unit_scale=True,
        desc=name,
        leave=False,
        disable=not (in_notebook or sys.stderr.isatty()),
    )

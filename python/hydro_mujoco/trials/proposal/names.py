"""What the names of a table's columns say: units, and which column is the time."""

import re
from collections.abc import Iterable

from ..clock import TIME_COLUMNS

#: Unit -> how the end of a column's name writes it, after a separator or in brackets.
_WRITTEN = {
    "deg/s": ("deg_s", "deg/s", "degs", "dps"),
    "rad/s": ("rad_s", "rad/s", "rads", "rps"),
    "deg": ("deg", "degrees"),
    "rad": ("rad", "radians"),
    "m/s^2": ("m_s2", "m/s^2", "m/s2", "mps2", "ms2"),
    "m/s": ("m_s", "m/s", "mps"),
    "cm/s": ("cm_s", "cm/s", "cmps"),
    "mm/s": ("mm_s", "mm/s", "mmps"),
    "m": ("m", "metres", "meters"),
    "cm": ("cm",),
    "mm": ("mm",),
    "g": ("g",),
    "mg": ("mg",),
    "Pa": ("pa",),
    "hPa": ("hpa",),
    "mbar": ("mbar",),
    "kPa": ("kpa",),
    "bar": ("bar",),
    "N": ("n",),
    "N m": ("nm", "n_m", "n m"),
    "us": ("us", "pwm"),
    "%": ("%", "percent"),
}
_UNITS = {text: unit for unit, texts in _WRITTEN.items() for text in texts}
_LONGEST_FIRST = sorted(_UNITS, key=len, reverse=True)
_ANY = "|".join(map(re.escape, _LONGEST_FIRST))
#: After an underscore `n` is north (`v_n`, `pos_n_m`), not newton.
_AFTER_UNDERSCORE = "|".join(re.escape(text) for text in _LONGEST_FIRST if text not in ("n", "n_m"))
_ENDING = re.compile(rf"(.+?)(?:[_ ]({_AFTER_UNDERSCORE})|[_ ]*[\[(]({_ANY})[\])])", re.IGNORECASE)
_TIME = re.compile(r"(?:time|t|timestamp|stamp)[_ ]*[\[(]?(s|sec|seconds|ms|us|ns)?[\])]?", re.IGNORECASE)


def unit_of(column: str) -> tuple[str, str | None]:
    """A column's name without its unit, and the unit: `roll_deg`, `roll [deg]` -> `roll`, `deg`."""
    if match := _ENDING.fullmatch(column):
        return match[1], _UNITS[(match[2] or match[3]).lower()]
    return column, None


def time_of(columns: Iterable[str]) -> tuple[str, str] | None:
    """The column of the time and its unit, `time_ms` -> `time_ms`, `ms`; None where no name says it."""
    columns = list(columns)
    named = [column for column in TIME_COLUMNS if column in columns]
    for column in [*named, *columns]:
        if match := _TIME.fullmatch(column):
            unit = (match[1] or "s").lower()
            return column, unit if unit in ("ms", "us", "ns") else "s"
    return None

"""Mapping files, `hydro-mapping/1`: which field of a log is which number of a model.

schema.py   `Mapping` and its parts
parse.py    TOML into a `Mapping`, checked against the model
sources.py  one source: topic, fields, unit, frame
turns.py    velocities that an attitude turns
values.py   values by key
"""

from .parse import parse
from .schema import SCHEMA, Mapping, Source

__all__ = ["SCHEMA", "Mapping", "Source", "parse"]

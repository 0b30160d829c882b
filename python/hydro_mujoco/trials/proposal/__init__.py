"""What a log holds, and a mapping for it.

messages.py  known messages: quantity, unit and frame of their fields
names.py     units and times in the names of columns
shapes.py    fields of unknown messages, grouped by name
match.py     fields for the sensors and actuators of a model
toml.py      the mapping's text
"""

import os
from dataclasses import dataclass

import mujoco

from ..log import Log, Topic
from ..model import load
from ..words import listed
from .match import actuators, sensors
from .toml import text

__all__ = ["Proposal", "propose"]

#: Fields of a topic that a listing shows at most.
SHOWN = 12


@dataclass(frozen=True)
class Proposal:
    """topics: of the log; toml: a mapping; open: sensors and actuators without a match; faults: of the file."""

    log: str
    topics: dict[str, Topic]
    toml: str
    open: list[str]
    faults: list[str]

    def listing(self) -> str:
        """What the log holds, a line a topic."""
        lines = [self.log]
        for topic in self.topics.values():
            rate = f", {topic.rate:.4g} Hz" if topic.rate else ""
            fields = [field for field in topic.fields if "covariance" not in field]
            more = f", ... ({len(fields)} fields)" if len(fields) > SHOWN else ""
            lines.append(f"  {topic.name}  {topic.type}  {topic.count} messages{rate}")
            lines.append(f"      {', '.join(fields[:SHOWN])}{more}")
        lines += [f"  SUSPECT: {fault}" for fault in self.faults]
        if self.open:
            lines.append(f"  nothing found for {listed(self.open)}")
        return "\n".join(lines)

    def __str__(self) -> str:
        return f"{self.listing()}\n\n{self.toml}"


def propose(log: Log, model: str | os.PathLike | mujoco.MjSpec) -> Proposal:
    """What a log holds, and a mapping for it by types of messages and names."""
    nominal, topics = load(model), log.topics()
    found, driven = sensors(nominal, topics), actuators(nominal, topics)
    missing = [name for name in nominal.sensors if name not in found]
    missing += [name for name in nominal.actuators if name not in driven]
    mapping = text(nominal, found, driven, log.is_table)
    return Proposal(f"{log.path} ({log.kind})", topics, mapping, missing, log.faults)

"""A target figure: its value, its limit, met or not."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """A figure and its limit."""

    what: str
    value: float
    limit: float
    #: True where the value must not fall below the limit.
    least: bool = False
    #: Whether the value rests on times.
    timed: bool = True

    @property
    def met(self) -> bool:
        return self.value >= self.limit if self.least else self.value <= self.limit

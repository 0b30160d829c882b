"""What is aimed at, and whether it is there."""

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

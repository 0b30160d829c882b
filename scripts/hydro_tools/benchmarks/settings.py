"""How long a run is."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """`quick` is for seeing that everything works; its numbers are worth little."""

    quick: bool = False

    def pick(self, full, quick):
        """One of the two."""
        return quick if self.quick else full

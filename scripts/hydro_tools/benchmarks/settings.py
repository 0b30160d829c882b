"""Length of a run: full or quick."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """quick: few short blocks, to see that everything works; the numbers are worth little."""

    quick: bool = False

    def pick(self, full, quick):
        """`full`, or `quick` in a quick run."""
        return quick if self.quick else full

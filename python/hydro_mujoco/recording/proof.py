"""Proof that another machine computes the very bits of this one.

Another release of MuJoCo or NumPy, or a processor for which their libraries choose other instructions, may round
otherwise; a swimming robot makes much of a last bit. So a worker elsewhere makes one trajectory that is known first.
"""

import hashlib
import platform
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from ..errors import DataError


def machine() -> str:
    """Versions and processor that decide about the bits here, for people to compare."""
    return f"{platform.node()}: MuJoCo {mujoco.__version__}, NumPy {np.__version__}, {platform.platform()}"


@dataclass(frozen=True)
class Proof:
    """sha256 of known bytes, and the machine that made them."""

    sha256: str
    made_on: str

    @staticmethod
    def from_bytes(known: bytes) -> "Proof":
        """The proof that this machine gives."""
        return Proof(hashlib.sha256(known).hexdigest(), machine())

    def check(self, make: Callable[[], bytes]) -> None:
        """Make the known bytes, once a process; refuses a machine that makes others."""
        if self not in _HELD:
            if hashlib.sha256(make()).hexdigest() != self.sha256:
                raise DataError(
                    f"this node rounds otherwise than the machine that asks, so its shards would have "
                    f"other bytes: leave it out, or give it the same packages and kind of processor "
                    f"({machine()}; expected as on {self.made_on})"
                )
            _HELD.add(self)


_HELD: set[Proof] = set()

"""Numbers of worlds side by side: the memory layout of the networks."""

import warp as wp

#: Worlds in a group: a product reads each weight once for all of them.
LANES = wp.constant(4)


class Lanes:
    """An array of numbers a world, four worlds side by side.

    Attributes:
        numbers: shape (groups, width, 4), world 4 g + l at [g, :, l].
        groups: the same memory by fours, shape (groups, width).
    """

    def __init__(self, groups: int, width: int, device: wp.Device):
        self.numbers = wp.zeros((groups, width, LANES), dtype=float, device=device)
        self.groups = wp.array(ptr=self.numbers.ptr, dtype=wp.vec4, shape=(groups, width), device=device)


def groups_of(nworld: int) -> int:
    """Groups that hold so many worlds."""
    return -(-nworld // LANES)

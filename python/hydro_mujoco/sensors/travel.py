"""When sound meets an instrument that moves."""

import numpy as np


def meeting(
    origin: np.ndarray,
    sent: float,
    speed: float,
    before: tuple[float, np.ndarray],
    after: tuple[float, np.ndarray],
) -> tuple[float, np.ndarray] | None:
    """Time [s] and place [m] at which sound from an origin [m] meets an instrument, None where it has not by `after`.

    Args:
        origin: where the sound was sent, shape (3,). sent: when [s]. speed: of sound [m/s].
        before, after: time [s] and place [m] of the instrument, which moves in a straight line between them.
    """
    (first, start), (last, end) = before, after
    # Way of the sound beyond the instrument, at both ends.
    passed = [speed * (time - sent) - float(np.linalg.norm(place - origin)) for time, place in (before, after)]
    if passed[1] < 0:
        return None
    share = -passed[0] / (passed[1] - passed[0]) if passed[0] < 0 else 0.0
    return first + share * (last - first), start + share * (end - start)

"""Dispersion of linear waves, omega^2 = g k tanh(k d), as in crates/effects/src/sea/dispersion.rs."""

import numpy as np

#: Steps of Newton's method for the wave number; five are enough at every depth.
STEPS = 8


def wavenumber(frequency: np.ndarray, depth: float, gravity: float) -> np.ndarray:
    """Wave numbers k [rad/m] of angular frequencies omega: omega^2 = g k tanh(k d).

    Newton's method on x tanh x = omega^2 d / g from C. Eckart's start (NBS Circular 521, 1952).
    """
    deep = frequency**2 / gravity
    if np.isinf(depth):
        return deep
    right = np.minimum(deep * depth, 20.0)
    x = right / np.sqrt(np.tanh(right))
    for _ in range(STEPS):
        tanh = np.tanh(x)
        x = x - (x * tanh - right) / (tanh + x * (1 - tanh * tanh))
    # Beyond 20 tanh x is 1 to the last bit.
    return np.where(deep * depth > 20, deep, x / depth)

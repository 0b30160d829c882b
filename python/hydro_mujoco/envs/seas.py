"""Seas drawn at random: currents and waves as the plugin's attributes have them."""

import json
from dataclasses import dataclass

import numpy as np

from ..errors import DataError

#: Most seas of an environment; each is a compiled model.
MOST = 1000


@dataclass(frozen=True)
class Sea:
    """A current and a wave spectrum."""

    #: `hydro-current/1`, JSON.
    current: str
    #: `hydro-waves/1`, JSON.
    waves: str


def draw_seas(number: int, seed: int, current: float, wave_height: float) -> list[Sea]:
    """Seas that depend on their number and the seed alone.

    Args:
        number: how many.
        seed: of all of them.
        current: fastest mean current [m/s]; its direction is drawn, it falls to half at 10 m and has gusts.
        wave_height: greatest significant height [m]; JONSWAP, peak period 4 to 7 s, direction drawn.

    Raises:
        DataError: a number out of bounds.
    """
    bounds = (
        ("seas", number, 1, MOST),
        ("sea_seed", seed, 0, 2**63 - 1),
        ("current", current, 0, 2),
        ("wave_height", wave_height, 0, 1),
    )
    for name, found, least, most in bounds:
        if not least <= found <= most:
            raise DataError(f"{name} is {found}; expected {least} to {most}")
    return [_draw(np.random.default_rng([seed, each]), current, wave_height) for each in range(number)]


def _draw(random: np.random.Generator, fastest: float, highest: float) -> Sea:
    speed, angle = random.uniform(0, fastest), random.uniform(-np.pi, np.pi)
    velocity = speed * np.array([np.cos(angle), np.sin(angle), 0.0])
    gusts = 0.1 * speed
    current = {
        "schema": "hydro-current/1",
        "profile": [
            {"depth": 0, "velocity": velocity.tolist()},
            {"depth": 10, "velocity": (0.5 * velocity).tolist()},
        ],
        "random": {"deviation": [gusts, gusts, 0], "time_constant": 10, "seed": int(random.integers(2**31))},
    }
    height, period = random.uniform(0, highest), random.uniform(4, 7)
    waves = {
        "schema": "hydro-waves/1",
        "spectrum": "jonswap",
        "significant_height": max(height, 1e-3),
        "peak_period": period,
        "direction": random.uniform(-180, 180),
        "spreading": 10,
        "components": 30,
        "seed": int(random.integers(2**31)),
    }
    return Sea(json.dumps(current), json.dumps(waves))

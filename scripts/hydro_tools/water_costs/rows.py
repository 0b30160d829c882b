"""The rows of the table: every effect of the catalogue, hulls, whole matrices, currents, waves."""

import json
import tomllib
from dataclasses import dataclass, field

import mujoco
import numpy as np

import hydro_mujoco

from ..repository import ROOT
from ..soak import catalogue
from .scene import GEOMS, IDLE, MACHINE, Water, effect, model

#: Effects without a row of the catalogue: hulls have theirs.
ELSEWHERE = {"hydrostatics"}
#: An effect acts once on a body.
OTHER_IDLE = {"constant_force": [effect("net_buoyancy", {"force": 1e-9})]}
#: Effects that need a surface, and a hull that floats in it.
AT_THE_SURFACE = {"windage"}
AFLOAT = {"waterline": "0"}
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
BOAT = [
    effect("hydrostatics"),
    effect("added_mass", dict(zip(AXES, (5, 8, 10, 0.5, 0.5, 0.5)))),
    effect("linear_drag", dict(zip(AXES, (20, 40, 60, 3, 3, 3)))),
    effect("quadratic_drag", dict(zip(AXES, (20, 40, 60, 3, 3, 3)))),
]


@dataclass(frozen=True)
class Row:
    """A scene in water; beside it the same scene without the plugin, and without what is timed."""

    name: str
    water: Water
    #: What is left when what is timed is taken out.
    without: Water = field(default_factory=Water)
    geoms: str = GEOMS["box"]
    scene: dict = field(default_factory=dict)

    def models(self) -> tuple[mujoco.MjModel, mujoco.MjModel, mujoco.MjModel]:
        """Without the plugin, without what is timed, with it."""
        return tuple(model(self.geoms, water, **self.scene) for water in (None, self.without, self.water))


def of_the_catalogue() -> list[Row]:
    """A row an effect that the plugin applies, each parameter a standard deviation of its prior from doing nothing."""
    rows = []
    for each in catalogue.effects():
        name = each.effect
        if name in ELSEWHERE:
            continue
        held = [effect("hydrostatics")] if name in AT_THE_SURFACE else OTHER_IDLE.get(name, IDLE)
        given = AFLOAT if name in AT_THE_SURFACE else {}
        scene = MACHINE | ({"gravity": "0 0 -9.81"} if given else {})
        rows.append(Row(f"`{name}`", Water([*held, each.entry()], given), Water(held, given), scene=scene))
    return rows


def of_the_user() -> Row:
    """The tether of docs/own-effects.md."""
    definition = tomllib.loads((ROOT / "examples/tether/effects.d/tether.toml").read_text())
    tether = effect("user.tether", {"stiffness": 25.0, "length": 2.6, "drag": 1.8}, definition=definition)
    return Row("an effect of the user's, `user.tether`", Water([*IDLE, tether]), scene=MACHINE)


def of_matrices() -> list[Row]:
    """Whole matrices, with elements everywhere."""
    random = np.random.default_rng(1)
    root = random.uniform(-1, 1, (6, 6)) + 3 * np.eye(6)
    matrix = (root @ root.T).tolist()
    return [
        Row(f"`{name}`, whole matrix", Water([*IDLE, effect(name, {"matrix": matrix})]), scene=MACHINE)
        for name in ("added_mass", "linear_drag", "quadratic_drag")
    ]


def of_hulls() -> list[Row]:
    """Buoyancy of each form, half under water."""
    water = Water([*IDLE, effect("hydrostatics")], AFLOAT)
    return [Row(f"`hydrostatics`, {name}", water, geoms=geom) for name, geom in GEOMS.items()]


def sea(**given) -> dict[str, str]:
    """The attribute `waves`."""
    return AFLOAT | {"waves": json.dumps({"schema": "hydro-waves/1", **given})}


def stream(**given) -> dict[str, str]:
    """The attribute `current`."""
    return AFLOAT | {"current": json.dumps({"schema": "hydro-current/1", **given})}


def of_motions() -> list[Row]:
    """The boat of four effects, and what currents and waves add to it."""
    depths = [{"depth": float(depth), "velocity": [0.5 - 0.04 * depth, 0, 0]} for depth in range(10)]
    random = np.random.default_rng(1)
    grid = {"x": [-50, 0, 50, 100], "y": [-50, 0, 50, 100], "depth": [0, 5, 10, 20], "time": [0, 3600, 7200]}
    grid["velocity"] = random.normal(0, 0.2, (4 * 4 * 4 * 3, 3)).round(3).tolist()
    gusts = {"deviation": [0.1, 0.1, 0], "time_constant": 20}
    spectrum = {"spectrum": "jonswap", "significant_height": 0.3, "peak_period": 14}
    kinds = {
        "a constant current": AFLOAT | {"current": "0.2 0 0"},
        "a profile of ten depths": stream(profile=depths),
        "a grid of 4 x 4 x 4 points at 3 times": stream(grid=grid),
        "a random current": stream(velocity=[0.2, 0, 0], random=gusts),
        "a regular wave": sea(components=[{"height": 0.2, "period": 6}]),
        "a sea of 60 waves": sea(**spectrum),
        "a short wave, by panels": sea(components=[{"height": 0.1, "period": 2}]),
    }
    still = Water(BOAT, AFLOAT)
    rows = [Row("a boat: `hydrostatics` on a box, added mass, both drags", Water([*IDLE, *BOAT], AFLOAT))]
    return rows + [Row(f"the boat in {name}", Water(BOAT, given), still) for name, given in kinds.items()]


def of_potential_flow() -> list[Row]:
    """Radiation of all six motions, and scattered waves."""
    w = np.linspace(0.2, 12, 60)
    damping, mass = np.zeros((2, 60, 6, 6))
    for k in range(6):
        damping[:, k, k] = (400 if k < 3 else 60) * w**2 / ((9 - w**2) ** 2 + 9 * w**2)
        mass[:, k, k] = 300 if k < 3 else 40
    excitation = np.full((60, 4, 6), 500 + 200j) * np.exp(-w / 4)[:, None, None]
    waves = sea(components=[{"height": 0.2, "period": 6}])
    file = hydro_mujoco.potential_flow(
        w, mass, damping, volume=0.4, point=(0, 0, -0.05), direction=[0, 90, 180, 270], excitation=excitation
    )
    flow = {"potential_flow": json.dumps(file)}
    states = len(file["radiation"]["a"])
    floats = Water([effect("hydrostatics"), *BOAT[2:]], waves)
    return [Row(f"`potential_flow`, {states} states, in a regular wave", Water(floats.effects, waves | flow), floats)]


def rows() -> list[Row]:
    """All rows."""
    return [*of_the_catalogue(), of_the_user(), *of_matrices(), *of_hulls(), *of_motions(), *of_potential_flow()]

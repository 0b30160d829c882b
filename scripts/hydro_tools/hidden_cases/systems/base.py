"""A system of the benchmark: a nominal scene, a way to be driven, effects that make sense on it."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from ..effects import Effect
from ..frames import exponential, product

#: Makes an effect of a kind from a generator of random numbers.
Factory = Callable[[np.random.Generator], Effect]


@dataclass(frozen=True)
class Twin:
    """An effect, the style of drive that hides what it is, and the effect that it then looks like."""

    factory: Factory
    style: str
    other: str


@dataclass(frozen=True)
class Schedule:
    """Trials of a case: count, rows each, row period [s]; how fast they are driven, 1 where a tool is to learn."""

    trials: int
    rows: int
    period: float
    speed: float = 1.0

    def size(self, rng: np.random.Generator, least: float, most: float) -> float:
        """Size of an excitation, at most 1: drawn from least to most in training trials, the most in faster ones."""
        drawn = float(rng.uniform(least, most))
        return drawn if self.speed == 1.0 else most


@dataclass
class Drive:
    """Drive of M trials: start states, and a policy `policy(row, plant) -> [M, nu]`."""

    qpos: np.ndarray
    qvel: np.ndarray
    policy: Callable
    modes: list[str]
    act: np.ndarray | None = None  # [M, na] activations at the start, zero where None

    def tiled(self, count: int) -> "Drive":
        """The same trials `count` times over."""
        return Drive(
            np.tile(self.qpos, (count, 1)),
            np.tile(self.qvel, (count, 1)),
            self.policy.tiled(count),
            self.modes * count,
            None if self.act is None else np.tile(self.act, (count, 1)),
        )


class System:
    """One family of cases."""

    name = "?"
    base = "?"
    #: Standard deviation of a centre of mass [m]; how many of the nominal's uncertainties count in the strength.
    com = 0.002
    most_nuisances: int | None = None
    #: Whether analogue sensors pass the recorder's filter.
    filtered = True
    #: Standard deviation of the white noise that commands are logged with (the robot follows them without it).
    command_noise = 0.0
    #: Class of a body by its name: uncertainties of bodies of one class are tied in the strength.
    tie: Callable[[str], str] | None = None

    def nominal_xml(self, noise: float) -> str:
        """The scene as the tool gets it, noise attributes multiplied."""
        raise NotImplementedError

    def shown_xml(self, xml: str) -> str:
        """The scene as it is written for the tool."""
        return xml

    def check(self, model: mujoco.MjModel, record) -> None:
        """Refuse trials in which something happens that no case is meant to have."""

    def plain_model(self, xml: str) -> mujoco.MjModel:
        """The scene without what needs the plugin library; same sensors and state but the plugin's."""
        return mujoco.MjModel.from_xml_string(xml)

    def truth_step(self, rng: np.random.Generator) -> tuple[float, int]:
        """Step [s] and integrator of the truth."""
        raise NotImplementedError

    def schedule(self, rng: np.random.Generator, *, small: bool) -> Schedule:
        """Length and number of the trials."""
        raise NotImplementedError

    def drive(self, rng: np.random.Generator, model: mujoco.MjModel, schedule: Schedule, style: str) -> Drive:
        """Start states and policy; `style` is `normal` or a restriction that an inseparable case needs."""
        raise NotImplementedError

    def water(self, members: int):
        """A nominal water outside the engine, or None."""
        return None

    def plugin_state(self) -> int:
        """Numbers of plugin state in the nominal's full-physics state."""
        return 0

    def singles(self, model: mujoco.MjModel) -> dict[str, Factory]:
        """Catalogue effects that can be seen on this system."""
        raise NotImplementedError

    def rivals(self, model: mujoco.MjModel, effect: Effect) -> dict[str, Factory]:
        """Effects that a hidden one is compared with, to say what it looks like."""
        return self.singles(model)

    def outside(self, model: mujoco.MjModel) -> dict[str, Factory]:
        """Effects beyond the catalogue."""
        raise NotImplementedError

    def twins(self, model: mujoco.MjModel) -> dict[str, Twin]:
        """Effects with a drive under which the data cannot tell them from another, by construction."""
        raise NotImplementedError

    def style_for(self, kind: str) -> str:
        """The drive that shows an effect."""
        return "normal"

    def known_position(self, rng: np.random.Generator, qpos: np.ndarray, layout) -> np.ndarray:
        """Start position as measured at rest: a third of a row's noise."""
        known = qpos.copy()
        if "position" in layout.noise and "attitude" in layout.noise:
            known[:3] += rng.normal(0, layout.noise["position"] / 3, 3)
            known[3:7] = product(qpos[3:7], exponential(rng.normal(0, layout.noise["attitude"] / 3, 3)))
        return known

"""The water about a body: level, velocity, pressure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from ..errors import DataError
from ..plugin import attribute
from ..water import body_number
from . import attributes
from .current import SET, Current
from .waves import Waves

#: Density of fresh water [kg/m^3], where nothing gives another.
FRESH_WATER = 1000.0
#: Largest component of a current that is set [m/s].
FASTEST = 100.0


@dataclass(frozen=True)
class Water:
    """The water about a body of a compiled model, as the plugin applies it; world frame, z up.

    Attributes:
        density: [kg/m^3]. gravity: [m/s^2].
        waterline: world z of the still surface [m]; None where there is none and everything is submerged.
        waves: about the waterline, None where there are none.
        current: of the attribute, None where the water stands still.
        steady: wind of MuJoCo's own fluid, which moves with the world, and effects `current` [m/s], shape (3,).
        swells: parameters of effects `waves`, each x, y, z [m/s], frequency [rad/s], phase [rad], vertical_lag [rad].
        memory: where the random part of the current, and what a program sets of it, are kept in `data.plugin_state`.
        states: numbers of that of the model.
    """

    density: float
    gravity: float
    waterline: float | None
    waves: Waves | None
    current: Current | None
    steady: np.ndarray
    swells: tuple[np.ndarray, ...]
    memory: slice
    states: int

    def level(self, x: np.ndarray | float, y: np.ndarray | float, time: float) -> np.ndarray:
        """World z of the surface [m] at x, y [m] and a time [s], of their shape; infinity without a waterline."""
        if self.waterline is None:
            return np.full(np.broadcast(x, y).shape, np.inf)
        if self.waves is None:
            return np.full(np.broadcast(x, y).shape, self.waterline)
        return self.waterline + self.waves.elevation(x, y, time)

    def is_wet(self, points: np.ndarray, time: float) -> np.ndarray:
        """Whether points [m] of shape (..., 3), world, are below the surface at a time [s]; shape (...)."""
        points = np.asarray(points, float)
        if self.waterline is None or self.waves is None:
            return points[..., 2] < (np.inf if self.waterline is None else self.waterline)
        # Below the deepest trough no wave need be summed.
        wet = np.asarray(points[..., 2] < self.waterline - self.waves.amplitude.sum())
        near = points[~wet]
        wet[~wet] = near[:, 2] < self.level(near[:, 0], near[:, 1], time)
        return wet

    def velocity(self, points: np.ndarray, data: mujoco.MjData) -> np.ndarray:
        """Velocity of the water [m/s] at points [m] of shape (..., 3), world, at the time of `data`; the same shape.

        A point above the surface has the velocity at the surface.
        """
        points = np.asarray(points, float)
        still = self.waterline or 0.0
        total = np.broadcast_to(self.steady, points.shape).copy()
        for x, y, z, frequency, phase, lag in self.swells:
            now = frequency * data.time + phase
            total += [x * np.cos(now), y * np.cos(now), z * np.cos(now - lag)]
        if self.waves is not None:
            total += self.waves.velocity(points - [0, 0, still], data.time)
        if self.current is not None:
            flat = points.reshape(-1, 3) * [1, 1, -1] + [0, 0, still]
            mean = self.current.mean(flat, data.time).reshape(points.shape)
            total += mean + self.current.remembered(data.plugin_state[self.memory])
        return total

    def set_current(self, data: mujoco.MjData, velocity: Sequence[float] | np.ndarray) -> None:
        """Sets what is added to the current of this instance's attribute, everywhere, from now on.

        It is a part of the state of `data`, `plugin_state`: copies and restored states have it, `mj_resetData` takes it
        back. Any time between steps is a good one; each data of a model may have another.

        Args:
            data: of the model. velocity: [m/s], world, three numbers from -100 to 100.

        Raises:
            DataError: the attribute `current` is not settable, the velocity is none, or the data are not the model's.

        >>> import mujoco, hydro_mujoco as hydro
        >>> spec = mujoco.MjSpec.from_string('''<mujoco><worldbody><body name="hull"><freejoint/>
        ...   <geom type="ellipsoid" size="0.33 0.18 0.1" mass="12"/></body></worldbody></mujoco>''')
        >>> current = {"schema": "hydro-current/1", "velocity": [0, 0, 0], "settable": True}
        >>> spec = hydro.add_water(spec, body="hull", effects={"hydrostatics": {}}, current=current)
        >>> model = spec.compile(); data = mujoco.MjData(model)
        >>> about = hydro.sea.water(model, "hull")
        >>> about.set_current(data, (0.3, 0, 0))
        >>> about.velocity((0, 0, -30), data).tolist()
        [0.3, 0.0, 0.0]
        """
        if self.current is None or not self.current.is_settable:
            raise DataError('attribute `current` is not settable: "settable": true in its hydro-current/1 makes it so')
        if len(data.plugin_state) != self.states:
            raise DataError(f"the data have {len(data.plugin_state)} numbers of plugin state, the model {self.states}")
        try:
            wanted = np.asarray(velocity, float)
        except (TypeError, ValueError):
            wanted = np.empty(0)
        if wanted.shape != (3,) or not np.all(np.abs(wanted) <= FASTEST):
            raise DataError(f"velocity {velocity}: expected three numbers from -{FASTEST:g} to {FASTEST:g} m/s")
        data.plugin_state[self.memory][-SET:] = wanted

    def pressure(self, points: np.ndarray, time: float) -> np.ndarray:
        """Pressure of the water above the air's [Pa] at points [m] of shape (..., 3), world; shape (...).

        Hydrostatic from the waterline (world z = 0 without one) and that of the waves; 0 above the surface.

        Source: R. G. Dean and R. A. Dalrymple, Water Wave Mechanics for Engineers and Scientists, 1991, chapter 4.
        """
        below = np.asarray(points, float) - [0, 0, self.waterline or 0.0]
        dynamic = 0.0 if self.waves is None else self.waves.pressure(below, time)
        return self.density * np.maximum(dynamic - self.gravity * below[..., 2], 0)


def water(model: mujoco.MjModel, body: str) -> Water:
    """The water about a body: that of the instance of `hydro.wrench` that it, or the nearest body above it, carries.

    Where none does, it is that of the model's only instance. What the attributes of the compiled model say is read
    once. Effects of your own (`user.NAME`) do not move water.

    Raises:
        DataError: there is no such body, or none of these carries the plugin, and the model has none or several.

    >>> import mujoco, hydro_mujoco as hydro
    >>> spec = mujoco.MjSpec.from_string('''<mujoco><worldbody><body name="hull"><freejoint/>
    ...   <geom type="ellipsoid" size="0.33 0.18 0.1" mass="12"/></body></worldbody></mujoco>''')
    >>> spec = hydro.add_water(spec, body="hull", effects={"hydrostatics": {}}, waterline=0,
    ...   waves=[{"height": 0.3, "period": 4.5}], current=(0.2, 0, 0))
    >>> model = spec.compile(); data = mujoco.MjData(model)
    >>> about = hydro.sea.water(model, "hull")
    >>> float(about.level(0, 0, time=0.0)), about.velocity((0, 0, -30), data).round(6).tolist()
    (0.15, [0.200539, 0.0, 0.0])
    """
    return water_about(model, body_number(model, body))


def water_about(model: mujoco.MjModel, body: int) -> Water:
    """`water` of the body of a number."""
    instance = attributes.instance_about(model, body)
    density = attributes.number(model, instance, "density")
    gravity = float(np.linalg.norm(model.opt.gravity))
    waves = attributes.document(model, instance, "waves")
    steady, swells = _moved_by_effects(model)
    current = _current(model, instance)
    last = int(model.plugin_stateadr[instance] + model.plugin_statenum[instance])
    return Water(
        density=density if density is not None else float(model.opt.density) or FRESH_WATER,
        gravity=gravity,
        waterline=attributes.number(model, instance, "waterline"),
        waves=None if waves is None else Waves.read(waves, gravity),
        current=current,
        steady=steady,
        swells=swells,
        # The last of the instance's memory (src/mujoco/effects/bind.rs).
        memory=slice(last - (0 if current is None else current.memory), last),
        states=int(model.npluginstate),
    )


def _current(model: mujoco.MjModel, instance: int) -> Current | None:
    text = (attribute(model, instance, "current") or "").strip()
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        document = attributes.document(model, instance, "current")
        return None if document is None else Current.read(document)
    return Current.read({"velocity": numbers}) if numbers else None


def _moved_by_effects(model: mujoco.MjModel) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """What moves all water of a model: wind of MuJoCo's own fluid and effects `current`; effects `waves`."""
    has_fluid = model.opt.density > 0 or model.opt.viscosity > 0
    steady = model.opt.wind.copy() if has_fluid else np.zeros(3)
    swells = []
    for instance in attributes.instances(model):
        effects: Mapping[str, Any] = attributes.document(model, instance, "effects") or {"effects": []}
        for effect in effects["effects"]:
            parameters = effect["parameters"]
            if effect["effect"] == "current":
                steady += [parameters[axis] for axis in ("x", "y", "z")]
            if effect["effect"] == "waves":
                names = ("x", "y", "z", "frequency", "phase", "vertical_lag")
                swells.append(np.array([parameters[name] for name in names], float))
    return steady, tuple(swells)

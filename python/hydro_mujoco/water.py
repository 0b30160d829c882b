"""Water for a body of a spec, and the wrench that it exerts."""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from .errors import DataError
from .plugin import declare, load_plugin
from .recording.kinematics import name_of

#: A value of an attribute: JSON as Python has it, JSON text, or the path of a file that holds it.
Json = Mapping[str, Any] | str | os.PathLike


def add_water(
    spec: mujoco.MjSpec,
    *,
    body: str,
    effects: Mapping[str, Any] | Sequence[Mapping[str, Any]] | str | os.PathLike | None = None,
    checkpoint: str | os.PathLike | None = None,
    waterline: float | None = None,
    current: Sequence[float] | Json | None = None,
    waves: Sequence[Mapping[str, Any]] | Json | None = None,
    density: float | None = None,
    hull: str | Iterable[str] | None = None,
    volume: float | None = None,
    centre_of_buoyancy: Sequence[float] | None = None,
) -> mujoco.MjSpec:
    """Put a body of a spec into water; returns the spec, changed. Compile it and step.

    The body carries an instance of `hydro.wrench`, and the sensor `BODY_water` reads it (`wrench`). An effect of added
    mass gets the empty child body that MuJoCo needs to hold it, where the body has no child.

    Args:
        spec: of any MJCF, not compiled yet.
        body: name of the body that carries the water.
        effects: by name, with parameters (docs/water-without-a-network.md): `{"hydrostatics": {}, "quadratic_drag":
            {"surge": 18, ...}}`, all on `body`; or a list of `{"effect", "target", "parameters"}`, without `target`
            on `body`; or JSON `hydro-effects/1` or its file's path.
        checkpoint: folder of a trained force model, or the name of one of `hydro_mujoco.checkpoint`.
        waterline: world z of the still surface [m]; without it everything is submerged.
        current: velocity of the water in the world [m/s], three numbers; or JSON `hydro-current/1` or a path.
        waves: components, `[{"height": 0.3, "period": 4.5, "direction": 20}]` [m, s, degrees]; or JSON `hydro-waves/1`
            or a path.
        density: of the water [kg/m^3]; 1000 by default.
        hull: names of the geoms that displace water; by default those that docs/plugin.md says.
        volume: that the body displaces [m^3]; its hull's by default.
        centre_of_buoyancy: where it acts [m], body frame, three numbers.

    Raises:
        DataError: there is no such body, it carries a plugin already, or nothing acts. A wrong effect or parameter is
            refused when the spec is compiled, by a ValueError that names it.

    >>> import mujoco, hydro_mujoco as hydro
    >>> spec = mujoco.MjSpec.from_string('''<mujoco><worldbody><body name="hull"><freejoint/>
    ...   <geom type="ellipsoid" size="0.33 0.18 0.1" mass="12"/></body></worldbody></mujoco>''')
    >>> spec = hydro.add_water(spec, body="hull", effects={"hydrostatics": {}}, waterline=0)
    >>> model = spec.compile(); data = mujoco.MjData(model); mujoco.mj_forward(model, data)
    >>> hydro.wrench(model, data, "hull").round(1).tolist()[2]  # half submerged: 12.4 L
    122.0
    """
    bodies = {found.name: found for found in spec.bodies if found.name and found.name != "world"}
    if body not in bodies:
        raise DataError(f"no body is called `{body}`; there are: {', '.join(f'`{name}`' for name in bodies) or 'none'}")
    carrier = bodies[body]
    if carrier.plugin.active:
        raise DataError(
            f"body `{body}` carries the plugin {carrier.plugin.plugin_name} already, and a body holds one: change that "
            "instance's config"
        )
    if effects is None and checkpoint is None:
        raise DataError("nothing acts: give effects, a checkpoint, or both")
    listed = None if effects is None else _effects(effects, body)
    centre = None if centre_of_buoyancy is None else _numbers("centre_of_buoyancy", centre_of_buoyancy)
    config = {
        "effects": listed,
        "checkpoint": None if checkpoint is None else os.fspath(checkpoint),
        "waterline": None if waterline is None else repr(float(waterline)),
        "current": None if current is None else _current(current),
        "waves": None if waves is None else _waves(waves),
        "density": None if density is None else repr(float(density)),
        "hull": hull if hull is None or isinstance(hull, str) else " ".join(hull),
        "volume": None if volume is None else repr(float(volume)),
        "centre_of_buoyancy": centre,
    }
    load_plugin()
    name = _free(f"{body}_water", {plugin.name for plugin in spec.plugins})
    if listed is not None and "added_mass" in listed and not carrier.bodies:
        carrier.add_body(name=_free(f"{body}_water", set(bodies)))
    sensor = spec.add_sensor(
        name=_free(f"{body}_water", {found.name for found in spec.sensors}), type=mujoco.mjtSensor.mjSENS_PLUGIN
    )
    given = {key: value for key, value in config.items() if value is not None}
    declare(spec, name, given, carrier, sensor)
    return spec


def wrench(model: mujoco.MjModel, data: mujoco.MjData, body: str) -> np.ndarray:
    """The water's wrench on a body: force [N], then torque [N m] about its origin, in the body's frame; shape (6,).

    It is what the instance's sensor reads: after `mj_forward` of the present state, after `mj_step` of the step's
    start. The part that is proportional to acceleration (added mass) is not in it.

    Raises:
        DataError: there is no such body, it carries no `hydro.wrench`, or no sensor reads its instance.

    Source: the checkpoint's card, and the equations of its effects in docs/reference-effects.md.

    >>> import mujoco, hydro_mujoco
    >>> model = mujoco.MjModel.from_xml_path(hydro_mujoco.scene("b1_swim"))
    >>> data = mujoco.MjData(model)
    >>> mujoco.mj_forward(model, data)
    >>> hydro_mujoco.wrench(model, data, "trunk").shape
    (6,)
    """
    number = body_number(model, body)
    instance = int(model.body_plugin[number])
    sensors = np.flatnonzero((model.sensor_type == mujoco.mjtSensor.mjSENS_PLUGIN) & (model.sensor_plugin == instance))
    if instance < 0:
        raise DataError(f"body `{body}` carries no hydro.wrench: hydro_mujoco.add_water gives it one")
    if not sensors.size:
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_PLUGIN, instance) or "NAME"
        raise DataError(
            f"no sensor reads the water of body `{body}`; declare one in the MJCF: "
            f'<sensor><plugin plugin="hydro.wrench" instance="{name}"/></sensor>'
        )
    start = model.sensor_adr[sensors[0]]
    return data.sensordata[start : start + 6].copy()


def body_number(model: mujoco.MjModel, body: str) -> int:
    """Number of the body of that name.

    Raises:
        DataError: there is none; the message lists what there is.
    """
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body)
    if number < 0:
        names = ", ".join(f"`{name_of(model, other)}`" for other in range(1, model.nbody))
        raise DataError(f"no body is called `{body}`; there are: {names or 'none'}")
    return int(number)


def _effects(value: Any, body: str) -> str:
    if isinstance(value, str | os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        if "effects" in value:
            return _json(value)
        value = [{"effect": name, "parameters": parameters} for name, parameters in value.items()]
    return _json({"schema": "hydro-effects/1", "effects": [{"target": body, **effect} for effect in value]})


def _current(value: Any) -> str:
    if isinstance(value, str | os.PathLike):
        return os.fspath(value)
    return _json(value) if isinstance(value, Mapping) else _numbers("current", value)


def _waves(value: Any) -> str:
    if isinstance(value, str | os.PathLike):
        return os.fspath(value)
    return _json(value if isinstance(value, Mapping) else {"schema": "hydro-waves/1", "components": list(value)})


def _json(value: Any) -> str:
    def plain(number: Any) -> Any:
        if isinstance(number, np.ndarray | np.generic):
            return number.tolist()
        raise TypeError(f"{number!r} is neither a number nor a name")

    return json.dumps(value, default=plain)


def _numbers(attribute: str, values: Sequence[float]) -> str:
    numbers = [float(value) for value in values]
    if len(numbers) != 3:
        raise DataError(f"{attribute} is {values}; expected three numbers")
    return " ".join(map(repr, numbers))


def _free(name: str, taken: set[str]) -> str:
    """The name, or the first of name_2, name_3, ... that is not taken."""
    return next(each for n in range(1, len(taken) + 3) if (each := name if n == 1 else f"{name}_{n}") not in taken)

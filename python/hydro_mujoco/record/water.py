"""The water of a model: MuJoCo's own fluid, effects of `hydro.wrench`, or both; what of it is the label.

An effect is *learned* where the motion that is recorded tells it: drags, lift, wakes. It stays *beside* the checkpoint
where it needs what no feature says, an acceleration (added mass) or a place (a surface, a wall), and where it moves the
water or acts on joints and actuators. So does buoyancy, unless it is asked for: it is known, and a hundred times the
drag. Recordings are made in water at rest: a current counts in the relative velocity, and acts again when the
checkpoint is loaded.
"""

import json
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
from mujoco.batch import Batch

from ..errors import DataError
from ..plugin import WRENCH, built_library
from ..reading import read_json
from ..recording.features import base_from_world
from ..recording.kinematics import name_of
from ..recording.system import Compiled
from .scene import Source, listed

FLUID, EFFECTS, BOTH = "fluid", "effects", "both"
KINDS = (FLUID, EFFECTS, BOTH)
SCHEMA = "hydro-effects/1"
#: Effects that move the water.
MOVES_WATER = frozenset({"current", "waves"})
#: Effects on a body that need its acceleration or its place, or are none of the water's.
NEEDS_MORE = frozenset({"added_mass", "payload", "free_surface", "wall_proximity", "hydrostatics", "constant_force"})
#: Effects that are buoyancy, wherever the body is.
BUOYANCY = frozenset({"net_buoyancy", "buoyancy_offset"})
#: Effects on joints, actuators and sensors begin so.
NOT_ON_BODIES = ("joint_", "actuator_", "sensor_", "inflow_")
#: Quantities of a user's effect that no feature tells (docs/own-effects.md).
PLACE = re.compile(r"\b(x|y|z|depth|t)\b")
#: Attributes of an instance that move the water, or say where its surface is.
MOVING, SURFACE = ("current", "waves"), "waterline"
#: Begins the names of what is added to a model for the recording.
ADDED = "hydro_record"


@dataclass(frozen=True)
class Instance:
    """An instance of `hydro.wrench`: its place among the spec's plugins, its body, its attributes, its effects."""

    index: int
    body: int
    config: dict[str, str]
    effects: list[dict]

    @property
    def has_checkpoint(self) -> bool:
        """True where it has a checkpoint."""
        return bool(self.config.get("checkpoint", "").strip())


@dataclass(frozen=True)
class Water:
    """The water that a model has, and what of it is the label: `kind`, with or without buoyancy."""

    kind: str
    has_buoyancy: bool = False
    instances: list[Instance] = field(default_factory=list)

    @property
    def effects(self) -> list[dict]:
        """The effects of all instances."""
        return [effect for instance in self.instances for effect in instance.effects]

    def learns(self, effect: dict) -> bool:
        """True where an effect is in the label."""
        return self.has_effects and is_learned(effect, self.has_buoyancy)

    @property
    def has_fluid(self) -> bool:
        """True where MuJoCo's own fluid is in the label."""
        return self.kind in (FLUID, BOTH)

    @property
    def has_effects(self) -> bool:
        """True where effects are in the label."""
        return self.kind in (EFFECTS, BOTH)


def instances(source: Source, model: mujoco.MjModel) -> list[Instance]:
    """The instances of `hydro.wrench`, their effects read."""
    out = []
    for index, plugin in enumerate(source.spec.plugins):
        if plugin.plugin_name != WRENCH:
            continue
        carriers = np.flatnonzero(model.body_plugin == index)
        if carriers.size:
            config = {key: value for key, value in dict(plugin.config).items() if value}
            out.append(Instance(index, int(carriers[0]), config, _effects(config.get("effects", ""), source.folder)))
    return out


def _effects(value: str, folder: Path) -> list[dict]:
    """The effects that an attribute gives: JSON, or the path of a file, looked for where the plugin does."""
    value = value.strip()
    if not value:
        return []
    name = f"effects `{value[:60]}`"
    if value.startswith("{"):
        try:
            content = json.loads(value)
        except (ValueError, RecursionError) as error:
            raise DataError(f"{name}: is no JSON ({error})") from error
    else:
        content = read_json(_file(value, name, folder), name)
    if not isinstance(content, dict) or not isinstance(content.get("effects"), list):
        raise DataError(f"{name}: no list `effects`; expected JSON of schema {SCHEMA}")
    return content["effects"]


def _file(value: str, name: str, folder: Path) -> Path:
    """The file that an attribute names, by the first of the places that has it."""
    named = os.environ.get("HYDRO_PATH", "").split(":")
    places = [place for place in (*named, ".", str(built_library().parent), str(folder)) if place]
    paths = [Path(place, value) for place in places]
    found = next((path for path in paths if os.path.exists(path)), None)
    if found is None:
        there = sorted({file.name for path in paths for file in path.parent.glob("*.json")})
        raise DataError(f"{name}: no such file in {', '.join(places)}; JSON files there: {listed(there)}")
    return found


def is_learned(effect: dict, buoyancy: bool) -> bool:
    """True where the recorded motion tells the effect."""
    name = str(effect.get("effect", ""))
    if name in BUOYANCY:
        return buoyancy
    if name.startswith("user."):
        definition = effect.get("definition", {})
        if definition.get("target") != "body" or definition.get("inertia"):
            return False
        expressions = [definition.get(part) or {} for part in ("let", "wrench", "world_force")]
        return not any(PLACE.search(str(text)) for part in expressions for text in part.values())
    return name not in MOVES_WATER | NEEDS_MORE and not name.startswith(NOT_ON_BODIES)


def find(source: Source, model: mujoco.MjModel, asked: str | None, buoyancy: bool) -> Water:
    """The water of a model: the kind asked for, else all that it has."""
    found = instances(source, model)
    fluid = model.opt.density > 0 or model.opt.viscosity > 0
    effects = any(i.has_checkpoint or any(is_learned(e, buoyancy) for e in i.effects) for i in found)
    if asked not in (None, *KINDS):
        raise DataError(f"water is `{asked}`; expected one of {', '.join(KINDS)}")
    has = {FLUID: fluid, EFFECTS: effects, BOTH: fluid and effects}
    if asked is None:
        asked = BOTH if fluid and effects else FLUID if fluid else EFFECTS
    if not has[asked]:
        raise DataError(_none(asked, has, [e for i in found for e in i.effects]))
    return Water(asked, buoyancy, found)


def _none(asked: str, has: dict[str, bool], beside: list[dict]) -> str:
    others = [kind for kind in (FLUID, EFFECTS) if has[kind]]
    if others:
        return f"water `{asked}` is asked for; the model has {others[0]} alone"
    text = (
        'the model has no water: give it MuJoCo\'s fluid (<option density="1000" viscosity="0.001"/>) or '
        "effects of hydro.wrench (docs/water-without-a-network.md)"
    )
    if beside:
        names = sorted({str(effect.get("effect")) for effect in beside})
        text += f". Of its effects none is learned from recorded motion: {', '.join(names)}"
    return text


def effects_text(effects: list[dict]) -> str:
    """The attribute `effects` of a list."""
    return json.dumps({"schema": SCHEMA, "effects": effects})


def at_rest(
    spec: mujoco.MjSpec, water: Water, keep: Callable[[dict], bool] = lambda effect: True, surface: bool = True
) -> None:
    """Stop the water of a spec. keep: which other effects stay; surface: whether a waterline does.

    `effects` stand in the attribute afterwards, whatever file they came from.
    """
    for instance in water.instances:
        config = {key: value for key, value in instance.config.items() if key not in MOVING}
        if not surface:
            config.pop(SURFACE, None)
        still = [effect for effect in instance.effects if effect.get("effect") not in MOVES_WATER and keep(effect)]
        if "effects" in config or "checkpoint" not in config:
            config["effects"] = effects_text(still)
        spec.plugins[instance.index].config = config
    spec.option.wind = [0.0, 0.0, 0.0]


@dataclass(frozen=True)
class Gauge:
    """A model whose effects are the learned ones alone, and the sensors that read them. Makes meters.

    bodies: number of each body that effects act on, with the place of its six numbers in sensordata.
    """

    compiled: Compiled
    base: int
    bodies: tuple[tuple[int, int], ...]

    def __call__(self, count: int) -> "EffectMeter":
        return EffectMeter(self, count)


class EffectMeter:
    """Reads the learned effects of many simulations at once (`recording.system.Meter`)."""

    def __init__(self, gauge: Gauge, count: int):
        self.gauge = gauge
        self.batch = Batch(gauge.compiled.model, count, 1)
        self.batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self.place, self.attitude = self.batch.bind("xpos"), self.batch.bind("xquat")
        self.sensors = self.batch.bind("sensordata")

    def read(self, state: dict[str, np.ndarray]) -> np.ndarray:
        """Wrench [m, 6] on the base, base frame, at states by field."""
        for name, values in state.items():
            self.batch.bind(name)[:] = values
        self.batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL.value)
        total = np.zeros((len(self.sensors), 6))
        base = self.gauge.base
        attitude = self.attitude[:, base]
        for body, at in self.gauge.bodies:
            force, torque = self.sensors[:, at : at + 3], self.sensors[:, at + 3 : at + 6]
            if body != base:
                # Into the world, then into the base frame, about the base origin.
                back = self.attitude[:, body] * np.array([1.0, -1.0, -1.0, -1.0])
                force = base_from_world(attitude, base_from_world(back, force))
                torque = base_from_world(attitude, base_from_world(back, torque))
                arm = base_from_world(attitude, self.place[:, body] - self.place[:, base])
                torque = torque + np.cross(arm, force)
            total[:, :3] += force
            total[:, 3:] += torque
        return total


def gauge(
    source: Source,
    model: mujoco.MjModel,
    water: Water,
    base: int,
    tree: list[int],
    library: Path | None,
    *,
    still: bool = False,
) -> Gauge:
    """The gauge of the learned effects on the bodies `tree`, of which `base` is one; still: of their buoyancy alone."""

    def counts(effect: dict) -> bool:
        return water.learns(effect) and (not still or effect.get("effect") in BUOYANCY)

    spec = source.spec.copy()
    at_rest(spec, water, counts, surface=False)
    numbers = {name_of(model, body): body for body in range(model.nbody)}
    wet = {numbers[effect["target"]] for effect in water.effects if counts(effect)}
    if not still:
        wet |= {instance.body for instance in water.instances if instance.has_checkpoint}
    measured = sorted(wet & set(tree))
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    carriers = {instance.body: instance.index for instance in water.instances}
    bodies = {body.id: body for body in spec.bodies}
    for body in measured:
        if body in carriers:
            plugin = spec.plugins[carriers[body]]
            if not plugin.name:
                plugin.name = bodies[body].plugin.name = f"{ADDED}_{body}"
            name = plugin.name
        else:
            name = _observer(spec, bodies[body], body)
        sensor = spec.add_sensor(name=f"{ADDED}_{body}", type=mujoco.mjtSensor.mjSENS_PLUGIN)
        sensor.plugin.plugin_name, sensor.plugin.name, sensor.plugin.active = WRENCH, name, True
    compiled = source.compiled(spec)
    places = tuple((body, int(compiled.sensor(f"{ADDED}_{body}").adr[0])) for body in measured)
    return Gauge(Compiled(compiled, library), base, places)


def _observer(spec: mujoco.MjSpec, body: mujoco.MjsBody, number: int) -> str:
    """An instance without effects of its own on a body that others' effects act on: its sensor reads them."""
    if body.plugin.active:
        raise DataError(
            f"effects act on body `{body.name}`, which carries the plugin {body.plugin.plugin_name}: the wrench on it "
            "cannot be read"
        )
    name = f"{ADDED}_{number}"
    spec.add_plugin(name=name, plugin_name=WRENCH, active=True).config = {"effects": effects_text([])}
    body.plugin.plugin_name, body.plugin.name, body.plugin.active = WRENCH, name, True
    return name


def described(water: Water) -> dict:
    """The manifest's `water`."""
    out: dict = {"kind": water.kind, "buoyancy": water.has_buoyancy, "at_rest": True}
    if water.effects:
        out["learned"] = [f"{e['effect']} on {e.get('target')}" for e in water.effects if water.learns(e)]
        out["beside"] = [f"{e['effect']} on {e.get('target')}" for e in water.effects if not water.learns(e)]
    return out

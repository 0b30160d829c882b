"""A scene with a checkpoint in place of the water that it was recorded in."""

import os
from pathlib import Path
from typing import Literal

import mujoco

from .errors import DataError
from .plugin import WRENCH, declare, load_plugin
from .reading import read_json
from .record import scene
from .record import water as waters
from .recording.kinematics import below, name_of


def with_checkpoint(
    model: str | os.PathLike | mujoco.MjSpec,
    checkpoint: str | os.PathLike,
    *,
    body: str | None = None,
    water: str | None = None,
    buoyancy: bool = False,
    outputs: Literal["wrench", "generalised"] | None = None,
    plugin: str | os.PathLike | None = None,
) -> mujoco.MjSpec:
    """The model's spec with a trained checkpoint instead of the water that `record` learned; compile it and step.

    MuJoCo's fluid is switched off where it was the label, and so are the learned effects; all other effects, a current
    and a waterline stay beside the checkpoint. The arguments `body`, `water` and `buoyancy` are those of the recording.

    Args:
        outputs: which of the checkpoint's outputs act: `wrench`, on the base alone, or `generalised`, the torques on
            the joints too; all that it has by default.

    Raises:
        DataError: the checkpoint has no torques of joints, though `outputs` asks for them; it is no checkpoint; or the
            body carries another plugin. A joint or body that its card names and the model lacks is refused when the
            spec is compiled, by a ValueError that lists what exists.
    """
    library = Path(plugin) if plugin is not None else None
    spec = _with_checkpoint(model, Path(checkpoint), body, water, buoyancy, library)
    if outputs is None:
        return spec
    _check_outputs(Path(checkpoint), outputs)
    for instance in spec.plugins:
        if instance.plugin_name == WRENCH and "checkpoint" in instance.config:
            instance.config = dict(instance.config) | {"outputs": outputs}
    return spec


def _check_outputs(checkpoint: Path, outputs: str) -> None:
    """Refuse torques of joints that a card does not have."""
    if outputs not in ("wrench", "generalised"):
        raise DataError(f"outputs={outputs!r}: expected 'wrench' or 'generalised'")
    names = _listed(checkpoint, "outputs")
    if outputs == "generalised" and not any(name.startswith("joint_torque.") for name in names):
        raise DataError(
            f"outputs='generalised': {checkpoint} gives the wrench on the base alone ({', '.join(names)}); train one "
            "with outputs='generalised'"
        )


def _listed(checkpoint: Path, key: str) -> list[str]:
    """Names that a checkpoint's card lists."""
    try:
        card = read_json(checkpoint / "card.json", f"checkpoint {checkpoint}, card.json")
    except DataError as error:
        raise DataError(f"{error}; expected a folder that hydro train wrote") from error
    if not isinstance(card, dict) or not isinstance(card.get(key), list):
        raise DataError(
            f"checkpoint {checkpoint}, card.json: no list `{key}`; expected a folder that hydro train wrote"
        )
    return [str(name) for name in card[key]]


def _with_checkpoint(
    model: str | os.PathLike | mujoco.MjSpec,
    checkpoint: Path,
    body: str | None,
    kind: str | None,
    buoyancy: bool,
    library: Path | None,
) -> mujoco.MjSpec:
    features = _listed(checkpoint, "features")
    load_plugin(library)
    source = scene.read(model, library)
    given = source.compiled()
    found = waters.instances(source, given)
    base = scene.base_body(given, body, [instance.body for instance in found])
    wet = waters.find(source, given, kind, buoyancy)
    spec = source.spec
    config = {"checkpoint": str(checkpoint.resolve())}
    # Effects beside the checkpoint take the density from the attribute once MuJoCo's fluid is off.
    if given.opt.density > 0 and ("density" in features or wet.effects):
        config["density"] = repr(float(given.opt.density))
    for instance in wet.instances:
        own = dict(instance.config)
        if wet.has_effects:
            own.pop("checkpoint", None)
            beside = [effect for effect in instance.effects if not wet.learns(effect)]
            own["effects"] = waters.effects_text(beside)
        elif instance.effects:
            own["effects"] = waters.effects_text(instance.effects)
        spec.plugins[instance.index].config = own
    if wet.has_fluid:
        spec.option.density = spec.option.viscosity = 0.0
        if any(spec.option.wind):
            config["current"] = " ".join(repr(float(speed)) for speed in spec.option.wind)
            spec.option.wind = [0.0, 0.0, 0.0]
    if buoyancy:
        for link in below(given, base):
            spec.bodies[link].gravcomp = 0.0
    carrier = next((instance for instance in wet.instances if instance.body == base), None)
    if carrier is not None:
        plugin = spec.plugins[carrier.index]
        own = config | dict(plugin.config) | {"checkpoint": config["checkpoint"]}
        if own.get("effects") == waters.effects_text([]):
            del own["effects"]
        plugin.config = own
        return spec
    holder = spec.bodies[base].plugin
    if holder.active:
        raise DataError(
            f"body `{name_of(given, base)}` carries the plugin {holder.plugin_name}; a body holds one, so the "
            "checkpoint has no place"
        )
    declare(spec, f"{waters.ADDED}_water", config, spec.bodies[base])
    return spec

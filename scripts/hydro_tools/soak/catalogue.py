"""Effects with typical values on the parts of the vehicle."""

from dataclasses import dataclass

from hydro_mujoco import gap

#: Parts of the vehicle by kind of target.
TARGETS = {"body": "hull", "joint": "hinge", "actuator": "tail"}
#: Effects on the link that turns.
ON_LINK = ("propeller",)
#: Places without bounds are a length of the body away by their prior, which no fin is.
NEAR = 0.25


@dataclass(frozen=True)
class Effect:
    """An entry of an `effects.json`."""

    effect: str
    target: str
    parameters: dict[str, float]

    def entry(self) -> dict:
        """As the file has it."""
        return {"effect": self.effect, "target": self.target, "parameters": self.parameters}


def effects(strength: float = 1.0) -> list[Effect]:
    """All effects that the plugin applies, each parameter at its null plus `strength` prior standard deviations.

    Effects on sensors belong to measurements, and backlash is a second joint of the MJCF; the plugin applies none.
    """
    known = gap.effects().values()
    return [_typical(of, strength) for of in known if of.target != "sensor" and of.id != "joint_backlash"]


def _typical(of: gap.Effect, strength: float) -> Effect:
    target = "fin" if of.id in ON_LINK else TARGETS[of.target]
    return Effect(of.id, target, {each.name: _value(each, strength) for each in of.parameters})


def _value(parameter: gap.Parameter, strength: float) -> float:
    value = parameter.null + strength * parameter.prior_sd
    if parameter.lower is not None:
        value = max(value, parameter.lower)
    elif parameter.unit == "m":
        value *= NEAR
    return value if parameter.upper is None else min(value, parameter.upper)

"""docs/reference-effects.md."""

from typing import Any

from .markdown import table

#: Where a patched model holds an effect.
PLACES = {
    "plugin": "the plugin's attribute `effects`",
    "mjcf": "plain MJCF where it has a form for it, else the plugin's attribute `effects`",
    "sensors": "the verdict's list of sensors; it has no place in an MJCF",
}
#: Effects that are held elsewhere than `effects --json` says.
ELSEWHERE = {"joint_backlash": "a second joint of the MJCF; among `effects` of the plugin it is refused"}
#: Kinds of targets in the order of the page.
KINDS = ("body", "actuator", "joint", "sensor")


def place(effect: dict[str, Any]) -> str:
    """Where a patched model holds an effect, in words."""
    return ELSEWHERE.get(effect["id"]) or PLACES.get(effect["placement"], effect["placement"])


def page(catalogue: dict[str, Any]) -> str:
    """The page, of what `hydro gap effects --json` prints."""
    effects = catalogue["effects"]
    kinds = [kind for kind in KINDS if any(effect["target"] == kind for effect in effects)]
    kinds += sorted({effect["target"] for effect in effects} - set(kinds))
    lines = [
        "<!-- Written by python scripts/make_reference.py from hydro gap effects --json; do not edit. -->",
        "",
        "# Effects",
        "",
        "How they are declared: [plugin.md](plugin.md#effects); how they are used: "
        "[water-without-a-network.md](water-without-a-network.md); how they are found in measurements: "
        "[gap.md](gap.md).",
        "",
        f"Null, prior and bounds are those of `hydro gap` for this example: {catalogue['example']}. They follow the "
        "size of the target. Names and units hold for every target of the kind, but that `cross_flow_drag` has the two "
        "axes across the body's longest. In the plugin's files values are held to physics alone.",
        "",
    ]
    rows = [
        (f"[`{effect['id']}`](#{effect['id']})", effect["target"], effect["summary"], _parameters(effect))
        for kind in kinds
        for effect in effects
        if effect["target"] == kind
    ]
    lines += table(("effect", "target", "what", "parameters"), rows)
    for kind in kinds:
        lines += ["", f"## On {'an' if kind[0] in 'aeiou' else 'a'} {kind}"]
        for effect in effects:
            if effect["target"] == kind:
                lines += ["", *_section(effect)]
    return "\n".join(lines) + "\n"


def _section(effect: dict[str, Any]) -> list[str]:
    phrase = effect["phrase"][0].upper() + effect["phrase"][1:]
    form = "the form of the real one differs a little" if effect["idealised"] else "this form is exact"
    rows = [
        (
            f"`{parameter['name']}`",
            "" if parameter["unit"] == "1" else parameter["unit"],
            _number(parameter["null"]),
            _number(parameter["prior_sd"]),
            f"{_bound(parameter['lower'], 'any')} to {_bound(parameter['upper'], 'any')}",
            _left_out(parameter),
        )
        for parameter in effect["parameters"]
    ]
    return [
        f"### {effect['id']}",
        "",
        f"{phrase}: {effect['summary']}.",
        "",
        "```",
        effect["equation"],
        "```",
        "",
        f"Source: {effect['source']}.",
        "",
        f"Idealisation: {form}. Written to: {place(effect)}."
        + ("" if effect["is_hypothesis"] else " `hydro gap` does not try it: it is part of a design."),
        "",
        *table(("parameter", "unit", "null", "prior sd", "bounds", "where left out"), rows),
    ]


def _parameters(effect: dict[str, Any]) -> str:
    """Names with units; a unit stands behind the last of those that share it."""
    listed = effect["parameters"]
    words = []
    for parameter, following in zip(listed, [*listed[1:], None]):
        shared = following is not None and following["unit"] == parameter["unit"]
        words.append(f"`{parameter['name']}`" + ("" if shared else f" [{parameter['unit']}]"))
    return ", ".join(words)


def _left_out(parameter: dict[str, Any]) -> str:
    """The value where a file leaves it out; nothing where a file gives it."""
    value = parameter["null"] if parameter["optional"] else parameter["left_out"]
    return "" if value is None else _number(value)


def _number(value: float) -> str:
    """Three digits, thousands apart."""
    return f"{float(f'{value:.3g}'):,g}"


def _bound(value: float | None, otherwise: str) -> str:
    return otherwise if value is None else _number(value)

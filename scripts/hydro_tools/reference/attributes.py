"""docs/reference-attributes.md."""

from typing import Any

from .markdown import table


def page(listed: dict[str, Any]) -> str:
    """The page, of what `hydro attributes --json` prints."""
    lines = [
        "<!-- Written by python scripts/make_reference.py from hydro attributes --json; do not edit. -->",
        "",
        "# Attributes",
        "",
        "What can stand in a `<config key=... value=.../>` of an instance; an empty value counts as none, an unknown "
        "key is refused. How they work together: [plugin.md](plugin.md). What the JSON of `effects`, `waves` and "
        "`current` holds: [plugin.md](plugin.md#effects), "
        "[waves and currents](water-without-a-network.md#waves-and-currents).",
    ]
    for plugin in listed["plugins"]:
        rows = [(f"`{one['name']}`", one["unit"] or "", one["meaning"], one["default"]) for one in plugin["attributes"]]
        lines += ["", f"## {plugin['plugin']}", "", *table(("attribute", "unit", "meaning", "default"), rows)]
    return "\n".join(lines) + "\n"

"""Nominal scenes: their folder, their noise, and their form without the plugin library."""

import re
import xml.etree.ElementTree as ET

from ..repository import ROOT

GAP = ROOT / "mjcf" / "gap"

_NOISE = re.compile(r'noise="([^"]+)"')


def with_noise(xml: str, factor: float) -> str:
    """The scene with every `noise` attribute multiplied."""
    return _NOISE.sub(lambda match: f'noise="{float(match[1]) * factor:.6g}"', xml)


def without_plugins(xml: str) -> str:
    """The scene without `extension` and without any `plugin` element."""
    root = ET.fromstring(xml)
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag == "extension" or child.tag == "plugin":
                parent.remove(child)
    return ET.tostring(root, encoding="unicode")


def without_noise(xml: str) -> str:
    """The scene without any `noise` attribute."""
    return _NOISE.sub("", xml)

"""Primitive shapes of B1, its visual and its collision geometry."""

from dataclasses import dataclass

from . import table

#: Colours by name (r g b a), and how shiny they are (specular, shininess, reflectance).
MATERIALS = {
    "shell": ((0.93, 0.69, 0.12, 1.0), (0.5, 0.6, 0.05)),
    "frame": ((0.16, 0.18, 0.21, 1.0), (0.4, 0.4, 0.0)),
    "motor": ((0.55, 0.58, 0.62, 1.0), (0.8, 0.8, 0.1)),
    "rubber": ((0.07, 0.07, 0.08, 1.0), (0.1, 0.1, 0.0)),
    "lens": ((0.10, 0.55, 0.80, 1.0), (1.0, 1.0, 0.2)),
}


@dataclass(frozen=True)
class Shape:
    """A primitive on a body. Size as in MuJoCo (half-lengths, radii) [m]; euler in rad, fixed axes x y z."""

    kind: str
    size: tuple[float, ...]
    centre: tuple[float, float, float]
    material: str
    euler: tuple[float, float, float] = (0.0, 0.0, 0.0)


_QUARTER = 1.5707963267948966


def shapes() -> dict[str, list[Shape]]:
    """Shapes by body."""
    along_x, along_y = (0.0, _QUARTER, 0.0), (_QUARTER, 0.0, 0.0)
    out = {
        "trunk": [
            Shape("box", (0.40, 0.085, 0.080), (0.015, 0.0, 0.0), "frame"),
            Shape("capsule", (0.062, 0.345), (0.015, 0.095, 0.028), "shell", along_x),
            Shape("capsule", (0.062, 0.345), (0.015, -0.095, 0.028), "shell", along_x),
            Shape("ellipsoid", (0.36, 0.125, 0.045), (0.0, 0.0, 0.085), "shell"),
            Shape("box", (0.045, 0.075, 0.055), (0.425, 0.0, 0.0), "frame"),
            Shape("ellipsoid", (0.035, 0.085, 0.065), (0.455, 0.0, 0.0), "shell"),
            Shape("sphere", (0.022,), (0.480, 0.035, 0.020), "lens"),
            Shape("sphere", (0.022,), (0.480, -0.035, 0.020), "lens"),
            Shape("ellipsoid", (0.045, 0.080, 0.065), (-0.400, 0.0, 0.0), "frame"),
        ]
    }
    for leg in table.LEGS:
        s = table.side(leg)
        out[f"{leg}_hip"] = [
            Shape("cylinder", (0.078, 0.055), (0.0, 0.0, 0.0), "frame", along_x),
            Shape("cylinder", (0.072, 0.030), (0.0, s * 0.050, 0.0), "motor", along_y),
        ]
        out[f"{leg}_thigh"] = [
            Shape("cylinder", (0.080, 0.028), (0.0, -s * 0.035, 0.0), "motor", along_y),
            Shape("cylinder", (0.060, 0.022), (0.0, s * 0.008, 0.0), "shell", along_y),
            Shape("capsule", (0.040, 0.140), (0.0, 0.0, -0.175), "frame"),
            Shape("capsule", (0.030, 0.105), (0.022, 0.0, -0.165), "shell"),
        ]
        out[f"{leg}_calf"] = [
            Shape("cylinder", (0.034, 0.027), (0.0, 0.0, 0.0), "motor", along_y),
            Shape("capsule", (0.021, 0.150), (0.004, 0.0, -0.175), "frame"),
            Shape("sphere", (table.FOOT_RADIUS,), (0.0, 0.0, -table.SEGMENT_LENGTH), "rubber"),
        ]
    return out

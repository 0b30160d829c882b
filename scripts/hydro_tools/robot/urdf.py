"""B1 as a URDF: every link of the description, fixed ones included; primitive shapes, no meshes.

URDF has neither capsule nor ellipsoid: a capsule is written as a cylinder with a sphere at each
end, an ellipsoid as the box of its semi-axes shrunk to the same volume.
"""

from math import pi

from . import looks, table
from .composition import rotation
from .text import element, number, vector


def _inertial(inertial: table.Inertial) -> list[str]:
    xx, yy, zz, xy, xz, yz = inertial.inertia
    return [
        "    <inertial>",
        f'      <origin xyz="{vector(inertial.com)}" rpy="0 0 0"/>',
        f'      <mass value="{number(inertial.mass)}"/>',
        "      " + element("inertia", ixx=xx, ixy=xy, ixz=xz, iyy=yy, iyz=yz, izz=zz),
        "    </inertial>",
    ]


def _solids(shape: looks.Shape) -> list[tuple[str, tuple[float, float, float]]]:
    """URDF geometries and their centres for one shape."""
    if shape.kind == "box":
        return [(element("box", size=[2 * half for half in shape.size]), shape.centre)]
    if shape.kind == "sphere":
        return [(element("sphere", radius=shape.size[0]), shape.centre)]
    if shape.kind == "ellipsoid":
        shrink = (4.0 / 3.0 * pi / 8.0) ** (1.0 / 3.0)
        return [(element("box", size=[2 * shrink * half for half in shape.size]), shape.centre)]
    radius, half = shape.size
    solids = [(element("cylinder", radius=radius, length=2 * half), shape.centre)]
    if shape.kind == "capsule":
        axis = rotation(shape.euler)[:, 2] * half
        for sign in (1.0, -1.0):
            solids.append((element("sphere", radius=radius), tuple(shape.centre + sign * axis)))
    return solids


def _geometry(shape: looks.Shape) -> list[str]:
    lines = []
    for solid, centre in _solids(shape):
        pose = f'<origin xyz="{vector(centre)}" rpy="{vector(shape.euler)}"/>'
        body = f"{pose}<geometry>{solid}</geometry>"
        lines.append(f'    <visual>{body}<material name="{shape.material}"/></visual>')
        lines.append(f"    <collision>{body}</collision>")
    return lines


def _joint(name: str, kind: str, parent: str, child: str, xyz, rpy, extra: list[str]) -> list[str]:
    return [
        f'  <joint name="{name}" type="{kind}">',
        f'    <origin xyz="{vector(xyz)}" rpy="{vector(rpy)}"/>',
        f'    <parent link="{parent}"/>',
        f'    <child link="{child}"/>',
        *extra,
        "  </joint>",
    ]


def urdf(header: str) -> str:
    """The whole file; `header` is the comment on top."""
    lines = ['<?xml version="1.0" encoding="utf-8"?>', f"<!-- {header} -->", '<robot name="b1">']
    for name, (rgba, _) in looks.MATERIALS.items():
        lines.append(f'  <material name="{name}"><color rgba="{vector(rgba)}"/></material>')
    shapes = looks.shapes()
    lines.append('  <link name="base"/>')
    lines += _joint("floating_base", "fixed", "base", "trunk", (0, 0, 0), (0, 0, 0), [])
    bodies = [("trunk", table.TRUNK)] + [(link.name, link.inertial) for link in table.moving_links()]
    moving = {link.name: link for link in table.moving_links()}
    for name, inertial in bodies:
        if name in moving:
            link = moving[name]
            limit = element("limit", lower=link.lower, upper=link.upper, effort=link.effort, velocity=link.velocity)
            extra = [
                f"    {element('axis', xyz=link.axis)}",
                '    <dynamics damping="0" friction="0"/>',
                f"    {limit}",
            ]
            lines += _joint(link.joint, "revolute", link.parent, name, link.origin, (0, 0, 0), extra)
        lines += [f'  <link name="{name}">', *_inertial(inertial)]
        for shape in shapes[name]:
            lines += _geometry(shape)
        lines.append("  </link>")
        for rider in table.fixed_links():
            if rider.parent == name:
                lines += _joint(rider.joint, "fixed", name, rider.name, rider.xyz, rider.rpy, [])
                lines += [f'  <link name="{rider.name}">', *_inertial(rider.inertial), "  </link>"]
    lines.append("</robot>")
    return "\n".join(lines) + "\n"

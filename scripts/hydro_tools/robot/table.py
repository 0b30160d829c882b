"""Unitree B1: masses, inertias, joints and limits, the only place where they stand.

Source: unitreerobotics/unitree_ros, commit d6f13aad60320ce1d60a07b82a76b5a553f2a0a9, files
robots/b1_description/xacro/b1.urdf and const.xacro (BSD-3-Clause). Facts only; no mesh is used.
SI units; positions in the frame of the parent link, inertias about the centre of mass, in the
link's frame. All joint frames of the robot are parallel when every joint is at zero.

The four legs are mirror images. `side` is +1 on the left (y > 0) and -1 on the right, `fore` is
+1 for the front legs and -1 for the rear ones.
"""

from dataclasses import dataclass

#: Leg order of the URDF, and of every list of joints in this project.
LEGS = ("FR", "FL", "RR", "RL")
#: Joints of a leg, from the trunk outwards.
SEGMENTS = ("hip", "thigh", "calf")


@dataclass(frozen=True)
class Inertial:
    """Mass [kg], centre of mass [m], inertia about it (xx, yy, zz, xy, xz, yz) [kg m^2]."""

    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class FixedLink:
    """A link without a joint of its own: `parent`, pose in it, and what it weighs."""

    name: str
    joint: str
    parent: str
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]
    inertial: Inertial


@dataclass(frozen=True)
class MovingLink:
    """A link on a hinge: joint origin [m], axis, limits [rad], effort [N m], speed [rad/s]."""

    name: str
    joint: str
    parent: str
    origin: tuple[float, float, float]
    axis: tuple[float, float, float]
    lower: float
    upper: float
    effort: float
    velocity: float
    inertial: Inertial


#: Hip joint, from the trunk's origin [m].
HIP_X, HIP_Y = 0.3455, 0.072
#: Hip to thigh joint, sideways [m].
THIGH_Y = 0.12675
#: Thigh joint to calf joint, and calf joint to the foot's centre [m].
SEGMENT_LENGTH = 0.35
#: Radius of the spherical foot [m].
FOOT_RADIUS = 0.04

TRUNK = Inertial(
    29.45,
    (0.008987, 0.002243, 0.003013),
    (0.183142146, 0.756327752, 0.783777558, -0.001379002, -0.027956055, 0.000193774),
)

_CENTRED = (0.0, 0.0, 0.0)
_HIP_ROTOR = Inertial(0.199, _CENTRED, (0.00039249, 0.000219397, 0.000219397, 0.0, 0.0, 0.0))
_LEG_ROTOR = Inertial(0.266, _CENTRED, (0.000485657, 0.00091885, 0.000485657, 0.0, 0.0, 0.0))
_FOOT = Inertial(0.05, _CENTRED, (3.2e-05, 3.2e-05, 3.2e-05, 0.0, 0.0, 0.0))
_CAMERA = Inertial(0.001, _CENTRED, (0.0001, 0.0001, 0.0001, 0.0, 0.0, 0.0))
_IMU = Inertial(0.001, _CENTRED, (0.0001, 1e-06, 0.0001, 0.0, 0.0, 0.0))

#: Sensors fixed to the trunk: name, joint, xyz, rpy, inertial.
_SENSORS = (
    ("imu_link", "imu_joint", (0.0, 0.0, 0.0), _CENTRED, _IMU),
    ("left_side_camera_link", "left_side_camera_joint", (-0.1086, 0.1371, -0.03077), (-0.331612, 0.0, 0.0), _CAMERA),
    ("right_side_camera_link", "right_side_camera_joint", (-0.1019, -0.1371, -0.03077), (0.331612, 0.0, 0.0), _CAMERA),
    ("head_camera_1_link", "head_camera_1_joint", (0.48883, 0.0, 0.0255), _CENTRED, _CAMERA),
    ("head_camera_2_link", "head_camera_2_joint", (0.4543, 0.0, -0.081), _CENTRED, _CAMERA),
    ("tail_camera_link", "tail_camera_joint", (-0.459, 0.0, -0.081), _CENTRED, _CAMERA),
)


def side(leg: str) -> float:
    """+1 for a left leg, -1 for a right one."""
    return 1.0 if leg[1] == "L" else -1.0


def fore(leg: str) -> float:
    """+1 for a front leg, -1 for a rear one."""
    return 1.0 if leg[0] == "F" else -1.0


def moving_links() -> list[MovingLink]:
    """The twelve links on joints, in the URDF's order."""
    links = []
    for leg in LEGS:
        s, f = side(leg), fore(leg)
        links += [
            MovingLink(
                f"{leg}_hip",
                f"{leg}_hip_joint",
                "trunk",
                (f * HIP_X, s * HIP_Y, 0.0),
                (1.0, 0.0, 0.0),
                -0.75,
                0.75,
                91.0035,
                19.69,
                Inertial(
                    2.15,
                    (-f * 0.020298, s * 0.009758, 0.000109),
                    (0.00406608, 0.008775259, 0.006060348, -s * f * 0.000288071, -f * 4.371e-06, s * 1.811e-06),
                ),
            ),
            MovingLink(
                f"{leg}_thigh",
                f"{leg}_thigh_joint",
                f"{leg}_hip",
                (0.0, s * THIGH_Y, 0.0),
                (0.0, 1.0, 0.0),
                -1.0,
                3.5,
                93.33,
                23.32,
                Inertial(
                    4.3,
                    (-0.000235, -s * 0.028704, -0.054169),
                    (0.044459086, 0.046023457, 0.008696078, s * 0.000128738, -0.002343913, s * 0.006032996),
                ),
            ),
            MovingLink(
                f"{leg}_calf",
                f"{leg}_calf_joint",
                f"{leg}_thigh",
                (0.0, 0.0, -SEGMENT_LENGTH),
                (0.0, 1.0, 0.0),
                -2.6,
                -0.6,
                140.0,
                15.55,
                Inertial(
                    1.05,
                    (0.005237, 0.0, -0.202805),
                    (0.015011003, 0.015159462, 0.000375749, 5.2e-08, 0.000250042, 4.61e-07),
                ),
            ),
        ]
    return links


def fixed_links() -> list[FixedLink]:
    """Sensors, rotors and feet: links of the URDF that ride on another link."""
    links = [FixedLink(name, joint, "trunk", xyz, rpy, inertial) for name, joint, xyz, rpy, inertial in _SENSORS]
    for leg in LEGS:
        s, f = side(leg), fore(leg)
        rides = (
            ("hip_rotor", "hip_rotor_joint", "trunk", (f * 0.1955, s * HIP_Y, 0.0), _HIP_ROTOR),
            ("thigh_rotor", "thigh_rotor_joint", f"{leg}_hip", (0.0, s * 0.00935, 0.0), _LEG_ROTOR),
            ("calf_rotor", "calf_rotor_joint", f"{leg}_thigh", (0.0, -s * 0.0519, 0.0), _LEG_ROTOR),
            ("foot", "foot_fixed", f"{leg}_calf", (0.0, 0.0, -SEGMENT_LENGTH), _FOOT),
        )
        links += [
            FixedLink(f"{leg}_{name}", f"{leg}_{joint}", parent, xyz, _CENTRED, inertial)
            for name, joint, parent, xyz, inertial in rides
        ]
    return links

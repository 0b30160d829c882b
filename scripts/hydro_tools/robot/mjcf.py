"""B1 as MJCF: one robot, six scenes that differ in the water.

Common to all: joints and servos in the URDF's order, fused inertias, 2 ms steps of the Euler
integrator. Euler, because every force of the water is explicit in it: the truth and the plugin's
scene then treat the water alike, and the fluid's velocity derivatives that implicitfast would
compute cost four times the step; at 2 ms the explicit drag on the lightest link is far from its
stability limit. No geom collides with another of the robot (contype 0); a floor with contype 1
would hold it (conaffinity 1).
"""

from . import looks, table
from .composition import fused
from .hull import FLUID_COEFFICIENTS, Hull, hulls
from .text import element, number

#: Water of the scenes that have any: fresh water at 20 degrees C, kg/m^3 and Pa s.
DENSITY, VISCOSITY = 1000.0, 0.001
#: Position servos: stiffness [N m/rad], damping [N m s/rad]. B1's own controller uses gains of this size.
SERVO_KP, SERVO_KV = 200.0, 8.0
#: Standing posture of a leg: hip, thigh, calf [rad].
HOME = (0.0, 0.75, -1.5)
#: Mass [kg] and inertia [kg m^2] of a body that only carries buoyancy: it weighs nothing, and the
#: inertia-box fluid model sees a cube of 0.24 mm, whose drag at 1 m/s is 3e-5 N.
FLOAT_MASS, FLOAT_INERTIA = 1e-6, 1e-14
#: Carriage of the towing tank: height of the rails [m], mass [kg], servo gains [N s/m].
GANTRY_HEIGHT, CARRIAGE_MASS, GANTRY_KV = 1.0, 20.0, 5000.0
#: Where the tow strut meets the trunk [m].
TOW_POINT = (0.0, 0.0, 0.13)
#: `fluidcoef` of MuJoCo's ellipsoid fluid by part of the robot.
Coefficients = dict[str, tuple[float, ...]]


def _option(*, density: float, viscosity: float) -> list[str]:
    return [
        '  <compiler angle="radian" autolimits="true" inertiafromgeom="false"/>',
        "  " + element("option", timestep=0.002, integrator="Euler", density=density, viscosity=viscosity),
    ]


def _look() -> list[str]:
    """Underwater light: blue gradient, haze, one soft key light from above."""
    lines = [
        "  <visual>",
        '    <global offwidth="1280" offheight="960" azimuth="140" elevation="-18"/>',
        '    <quality shadowsize="4096"/>',
        '    <headlight ambient="0.32 0.38 0.42" diffuse="0.30 0.36 0.40" specular="0.1 0.1 0.1"/>',
        '    <map fogstart="2.5" fogend="14" haze="0.4" shadowclip="2"/>',
        '    <rgba fog="0.05 0.26 0.38 1" haze="0.08 0.36 0.48 1" force="1 0.45 0.1 1"/>',
        "  </visual>",
        "  <asset>",
        '    <texture name="water" type="skybox" builtin="gradient" rgb1="0.22 0.62 0.72" rgb2="0.01 0.07 0.14" width="512" height="3072"/>',
    ]
    for name, (rgba, (specular, shininess, reflectance)) in looks.MATERIALS.items():
        lines.append(
            "    "
            + element("material", name=name, rgba=rgba, specular=specular, shininess=shininess, reflectance=reflectance)
        )
    lines += [
        '    <material name="hull" rgba="0.2 0.6 0.9 0.25"/>',
        "  </asset>",
        "  <default>",
        '    <geom contype="0" conaffinity="1"/>',
        '    <default class="look"><geom group="2"/></default>',
        '    <default class="hull"><geom type="ellipsoid" group="3" conaffinity="0" material="hull"/></default>',
        '    <default class="servo">' + element("position", kp=SERVO_KP, kv=SERVO_KV) + "</default>",
        "  </default>",
    ]
    return lines


def _inertial(inertial: table.Inertial) -> str:
    return element("inertial", pos=inertial.com, mass=inertial.mass, fullinertia=inertial.inertia)


def _hull(hull: Hull, *, fluid: Coefficients | None, buoyancy: bool) -> list[str]:
    """The hull's geom, and the weightless body through which buoyancy acts at its centre."""
    felt = {} if fluid is None else {"fluidshape": "ellipsoid", "fluidcoef": fluid[hull.part]}
    lines = [element("geom", name=hull.name, class_="hull", pos=hull.centre, size=hull.semi_axes, **felt)]
    if buoyancy:
        lift = DENSITY * hull.volume / FLOAT_MASS
        moments = (FLOAT_INERTIA,) * 3
        inertial = element("inertial", pos=(0, 0, 0), mass=FLOAT_MASS, diaginertia=moments)
        body = element(
            "body", close=False, name=hull.name.replace("_hull", "_buoyancy"), pos=hull.centre, gravcomp=lift
        )
        lines.append(f"{body}{inertial}</body>")
    return lines


def _shape(shape: looks.Shape) -> str:
    turn = {} if shape.euler == (0.0, 0.0, 0.0) else {"euler": shape.euler}
    return element(
        "geom", class_="look", type=shape.kind, size=shape.size, pos=shape.centre, material=shape.material, **turn
    )


def _robot(
    *,
    litres: float,
    fluid: Coefficients | None,
    buoyancy: bool,
    attachment: list[str],
    pos: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> list[str]:
    """The trunk and its legs, as lines of MJCF.

    fluid: coefficients of MuJoCo's ellipsoid fluid, None for none; attachment: first lines of the trunk (free joint,
    plugin, sites).
    """
    inertials, shapes = fused(), looks.shapes()
    hull_list = hulls(litres)
    moving = table.moving_links()

    def body(name: str, depth: int) -> list[str]:
        pad = "  " * depth
        link = next((link for link in moving if link.name == name), None)
        if link is None:
            lines = [pad + element("body", close=False, name=name, pos=pos)]
            lines += [f"{pad}  {line}" for line in attachment]
        else:
            lines = [pad + element("body", close=False, name=name, pos=link.origin)]
        lines.append(f"{pad}  {_inertial(inertials[name])}")
        if link is not None:
            lines.append(f"{pad}  " + element("joint", name=link.joint, axis=link.axis, range=(link.lower, link.upper)))
        lines += [f"{pad}  {_shape(shape)}" for shape in shapes[name]]
        for hull in hull_list:
            if hull.body == name:
                lines += [f"{pad}  {line}" for line in _hull(hull, fluid=fluid, buoyancy=buoyancy)]
        if name.endswith("calf"):
            lines.append(
                f"{pad}  "
                + element("site", name=name.replace("calf", "foot"), pos=(0, 0, -table.SEGMENT_LENGTH), size=[0.01])
            )
        for child in moving:
            if child.parent == name:
                lines += body(child.name, depth + 1)
        lines.append(f"{pad}</body>")
        return lines

    return body("trunk", 2)


def _servos() -> list[str]:
    return [
        "    "
        + element(
            "position",
            class_="servo",
            name=link.joint,
            joint=link.joint,
            ctrlrange=(link.lower, link.upper),
            forcerange=(-link.effort, link.effort),
        )
        for link in table.moving_links()
    ]


def _sensors(*, floating: bool) -> list[str]:
    """Sensors at the IMU (which sits in the trunk's origin) and in the joints."""
    lines = [
        '    <gyro name="imu_gyro" site="imu"/>',
        '    <accelerometer name="imu_accelerometer" site="imu"/>',
    ]
    if floating:
        lines += [
            '    <framequat name="base_quaternion" objtype="xbody" objname="trunk"/>',
            '    <velocimeter name="base_linear_velocity" site="imu"/>',
        ]
    lines += [f'    <jointpos name="{link.joint}_position" joint="{link.joint}"/>' for link in table.moving_links()]
    lines += [f'    <jointvel name="{link.joint}_velocity" joint="{link.joint}"/>' for link in table.moving_links()]
    return lines


_IMU = '<site name="imu" size="0.01"/>'
_TRACKING = '<camera name="track" mode="trackcom" pos="1.5 -1.9 0.75" xyaxes="0.78 0.62 0 -0.19 0.24 0.95"/>'
_LIGHTS = [
    '    <light name="sun" type="directional" dir="0.25 0.15 -1" diffuse="0.62 0.72 0.74" specular="0.3 0.3 0.3"/>',
    '    <light name="fill" type="directional" dir="-0.6 0.8 0.2" diffuse="0.05 0.14 0.18" specular="0 0 0" castshadow="false"/>',
]


def _home(*, floating: bool, gantry: bool = False) -> list[str]:
    legs = HOME * 4
    root = (0, 0, 0, 1, 0, 0, 0) if floating else (0, 0)
    control = ((0, 0) if gantry else ()) + legs
    return ["  <keyframe>", "    " + element("key", name="home", qpos=root + legs, ctrl=control), "  </keyframe>"]


def _free_scene(
    name: str,
    header: str,
    *,
    litres: float,
    density: float,
    viscosity: float,
    fluid: Coefficients | None,
    buoyancy: bool,
    extension: list[str] = (),
    attachment: list[str] = (),
    sensors: list[str] = (),
) -> str:
    """B1 on a free joint."""
    lines = [f"<!-- {header} -->", f'<mujoco model="{name}">', *_option(density=density, viscosity=viscosity)]
    lines += [*extension, *_look(), "  <worldbody>", *_LIGHTS]
    lines += _robot(
        litres=litres,
        fluid=fluid,
        buoyancy=buoyancy,
        attachment=['<freejoint name="base"/>', *attachment, _IMU, _TRACKING],
    )
    lines += ["  </worldbody>", "  <actuator>", *_servos(), "  </actuator>"]
    lines += ["  <sensor>", *_sensors(floating=True), *sensors, "  </sensor>", *_home(floating=True), "</mujoco>"]
    return "\n".join(lines) + "\n"


def robot(header: str, litres: float) -> str:
    """The robot alone, in a vacuum under gravity."""
    return _free_scene("b1", header, litres=litres, density=0, viscosity=0, fluid=None, buoyancy=False)


def truth(header: str, litres: float) -> str:
    """MuJoCo's ellipsoid fluid, and buoyancy a hull at a time: what the learned model is to reproduce."""
    return _free_scene(
        "b1 truth", header, litres=litres, density=DENSITY, viscosity=VISCOSITY, fluid=FLUID_COEFFICIENTS, buoyancy=True
    )


def identified(header: str, litres: float, fluid: Coefficients) -> str:
    """As `truth`, with the fluid coefficients that were identified from towing data."""
    return _free_scene(
        "b1 truth identified", header, litres=litres, density=DENSITY, viscosity=VISCOSITY, fluid=fluid, buoyancy=True
    )


def box_fluid(header: str, litres: float) -> str:
    """The baseline scene: MuJoCo's inertia-box fluid on every link, the same exact buoyancy."""
    return _free_scene(
        "b1 box fluid", header, litres=litres, density=DENSITY, viscosity=VISCOSITY, fluid=None, buoyancy=True
    )


def swim(header: str, litres: float) -> str:
    """The water is the plugin's: no fluid option, no buoyancy bodies, `hydro.wrench` on the trunk."""
    extension = [
        "  <extension>",
        '    <plugin plugin="hydro.wrench">',
        '      <instance name="water">',
        '        <config key="checkpoint" value="models/b1-task2"/>',
        f'        <config key="density" value="{number(DENSITY)}"/>',
        "      </instance>",
        "    </plugin>",
        "  </extension>",
    ]
    return _free_scene(
        "b1 swim",
        header,
        litres=litres,
        density=0,
        viscosity=0,
        fluid=None,
        buoyancy=False,
        extension=extension,
        attachment=['<plugin plugin="hydro.wrench" instance="water"/>'],
        sensors=['    <plugin name="water_wrench" plugin="hydro.wrench" instance="water"/>'],
    )


def tow(header: str, litres: float) -> str:
    """The truth's water; B1 hangs from a carriage that runs on two rails, a load cell in between."""
    extension = ["  <extension>", '    <plugin plugin="hydro.load_cell">']
    for quantity in ("force", "torque"):
        extension += [
            f'      <instance name="gantry_{quantity}">',
            '        <config key="site" value="gantry"/>',
            f'        <config key="quantity" value="{quantity}"/>',
            '        <config key="include" value="all"/>',
            "      </instance>",
        ]
    extension += ["    </plugin>", "  </extension>"]
    hang = (-TOW_POINT[0], -TOW_POINT[1], -TOW_POINT[2])
    lines = [f"<!-- {header} -->", '<mujoco model="b1 tow">', *_option(density=DENSITY, viscosity=VISCOSITY)]
    lines += [*extension, *_look(), "  <worldbody>", *_LIGHTS]
    lines += [
        '    <camera name="side" pos="0 -3.2 0.9" xyaxes="1 0 0 0 0.1 1"/>',
        f'    <body name="gantry" pos="0 0 {number(GANTRY_HEIGHT)}">',
        "      " + element("inertial", pos=(0, 0, 0), mass=CARRIAGE_MASS, diaginertia=(1, 1, 1)),
        '      <joint name="gantry_x" type="slide" axis="1 0 0"/>',
        '      <joint name="gantry_y" type="slide" axis="0 1 0"/>',
        # The carriage runs in air: a sphere of zero coefficients switches the box fluid off, and
        # the virtual mass of a sphere that does not turn exerts no force.
        '      <geom name="carriage" class="look" type="sphere" size="0.02" fluidshape="ellipsoid" fluidcoef="0 0 0 0 0" material="motor"/>',
        '      <geom class="look" type="box" size="0.12 0.12 0.03" pos="0 0 0.4" material="motor"/>',
        '      <geom class="look" type="cylinder" size="0.018 0.2" pos="0 0 0.2" material="motor"/>',
    ]
    site = element("site", name="gantry", pos=TOW_POINT, size=[0.015])
    lines += [
        "  " + line
        for line in _robot(litres=litres, fluid=FLUID_COEFFICIENTS, buoyancy=True, attachment=[site, _IMU], pos=hang)
    ]
    lines += ["    </body>", "  </worldbody>", "  <actuator>"]
    lines += [f'    <velocity name="gantry_{axis}" joint="gantry_{axis}" kv="{number(GANTRY_KV)}"/>' for axis in "xy"]
    lines += [*_servos(), "  </actuator>", "  <sensor>", *_sensors(floating=False)]
    lines += [
        '    <force name="gantry_force_dry" site="gantry"/>',
        '    <torque name="gantry_torque_dry" site="gantry"/>',
        '    <plugin name="gantry_force" plugin="hydro.load_cell" instance="gantry_force"/>',
        '    <plugin name="gantry_torque" plugin="hydro.load_cell" instance="gantry_torque"/>',
        '    <framepos name="gantry_position" objtype="site" objname="gantry"/>',
        '    <framelinvel name="gantry_velocity" objtype="site" objname="gantry"/>',
        "  </sensor>",
        *_home(floating=False, gantry=True),
        "</mujoco>",
    ]
    return "\n".join(lines) + "\n"

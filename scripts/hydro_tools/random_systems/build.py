"""Random nominals: a floating hull with thrusters and perhaps an arm, a tree of hinges, or a carriage with links.

All of it is a function of the random numbers alone. Names say nothing: bodies b0, b1, ..., joints j1, actuators u0, ...
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from ..hidden_cases.systems.generic import Robot

SENSOR, OBJECT, JOINT, GEOM = mujoco.mjtSensor, mujoco.mjtObj, mujoco.mjtJoint, mujoco.mjtGeom
KINDS = {"float": 0.4, "tree": 0.4, "rail": 0.2}
#: Standard deviation of a sensor's noise in the middle of what is drawn (a factor of 3 either way).
NOISE = {
    SENSOR.mjSENS_JOINTPOS: 1e-3,
    SENSOR.mjSENS_JOINTVEL: 1e-2,
    SENSOR.mjSENS_FRAMEPOS: 5e-3,
    SENSOR.mjSENS_FRAMEQUAT: 5e-3,
    SENSOR.mjSENS_GYRO: 1e-2,
    SENSOR.mjSENS_VELOCIMETER: 1e-2,
    SENSOR.mjSENS_ACCELEROMETER: 6e-2,
}
#: Row periods [s] and the steps of a nominal in each.
PERIODS = ((0.01, 4), (0.02, 5), (0.02, 8), (0.04, 10))


@dataclass
class _Draft:
    """What is built so far."""

    rng: np.random.Generator
    spec: mujoco.MjSpec
    wet: bool
    joints: list[str]


def robot(rng: np.random.Generator) -> Robot:
    """A random nominal and its drive."""
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    spec = mujoco.MjSpec()
    spec.modelname = "random"
    spec.compiler.degree = False
    wet = bool(rng.random() < (0.7 if kind == "float" else 0.4))
    draft = _Draft(rng, spec, wet, [])
    period, steps = PERIODS[int(rng.integers(len(PERIODS)))]
    spec.option.timestep, spec.option.integrator = period / steps, mujoco.mjtIntegrator.mjINT_RK4
    if wet:
        spec.option.density, spec.option.viscosity = 1000.0, 1e-3
    bodies = {"float": _float, "tree": _tree, "rail": _rail}[kind](draft)
    servo = bool(rng.random() < 0.5)
    band = float(rng.uniform(0.1, 0.3)), float(rng.uniform(0.8, 1.8))
    size = _drive_joints(draft, servo=servo, pace=2 * np.pi * band[1] * rng.uniform(1.5, 3.0))
    base = bodies[0] if kind == "float" else bodies[-1]
    _sensors(draft, kind, base)
    xml = spec.to_xml()
    model = mujoco.MjModel.from_xml_string(xml)
    reach = np.ones(model.nu)
    reach[: len(size)] = size
    return Robot(
        name=f"random_{kind}",
        xml=xml,
        base=base,
        qpos=model.qpos0.copy(),
        middle=np.zeros(model.nu),
        reach=reach,
        period=period,
        seconds=(float(rng.integers(8, 13)), 6.0),
        band=band,
        com=0.002,
        spread=0.1,
        noise_declared=bool(rng.random() < 0.7),
    )


def _hull(draft: _Draft, body, name: str, size: np.ndarray, centre: np.ndarray, density: float) -> None:
    """A hull along the body, whose mass is that of its shape."""
    kind = int(draft.rng.integers(3))
    geom = body.add_geom(name=f"{name}_shape", pos=centre, contype=0, conaffinity=0, density=density)
    if kind == 0:
        geom.type, geom.size = GEOM.mjGEOM_BOX, 0.8 * size
    elif kind == 1 or np.ptp(size[:2]) > 0.3 * size.max():
        geom.type, geom.size = GEOM.mjGEOM_ELLIPSOID, size
    else:
        geom.type, geom.size = GEOM.mjGEOM_CAPSULE, [size[:2].mean(), max(size[2] - size[:2].mean(), 0.02), 0]
    if draft.wet:
        geom.fluid_ellipsoid = 1.0
        geom.fluid_coefs = draft.rng.uniform([0.3, 0.1, 0.5, 0.0, 0.0], [1.0, 0.4, 2.0, 1.0, 1.0])


def _float(draft: _Draft) -> list[str]:
    """A hull that floats, neutral where there is water, without gravity where there is none."""
    rng, spec = draft.rng, draft.spec
    size = np.sort(rng.uniform([0.12, 0.08, 0.06], [0.4, 0.25, 0.18]))[::-1]
    body = spec.worldbody.add_body(name="b0", pos=[0, 0, -2])
    body.add_freejoint(name="j0")
    # Along x: a capsule's axis is its z.
    geom_size = size
    kind = int(rng.integers(2))
    geom = body.add_geom(name="b0_shape", contype=0, conaffinity=0, density=1000.0)
    geom.type = GEOM.mjGEOM_BOX if kind else GEOM.mjGEOM_ELLIPSOID
    geom.size = 0.8 * geom_size if kind else geom_size
    if draft.wet:
        geom.fluid_ellipsoid = 1.0
        geom.fluid_coefs = rng.uniform([0.3, 0.1, 0.5, 0.0, 0.0], [1.0, 0.4, 2.0, 1.0, 1.0])
    names = ["b0"]
    if rng.random() < 0.35:
        names += _links(
            draft, body, "b0", np.array([0, 0, -size[2]]), int(rng.integers(1, 3)), scale=0.35, neutral=True
        )
    if not draft.wet:
        spec.option.gravity = [0, 0, 0]
        for name in names:
            spec.body(name).gravcomp = 0.0
        # MuJoCo keeps a diagonal only for a floating body alone in its tree; an uncertain centre of mass needs more.
        body.add_body(name="b0_room")
    else:
        # Lift a little above the weight, so that it rights itself.
        mass = spec.compile().body("b0").mass[0]
        lift = body.add_body(name="b0_buoyancy", pos=[0, 0, rng.uniform(0.005, 0.03)], gravcomp=mass / 1e-6)
        lift.explicitinertial, lift.ipos, lift.iquat = True, [0, 0, 0], [1, 0, 0, 0]
        lift.mass, lift.inertia = 1e-6, [1e-14] * 3
    mass = float(spec.compile().body_subtreemass[1])
    count = int(rng.integers(4, 9))
    thrust = mass * rng.uniform(1.0, 3.0) / np.sqrt(count)
    for i in range(count):
        place = rng.uniform(-0.8, 0.8, 3) * size
        axis = np.eye(3)[i % 3] + rng.normal(0, 0.3, 3)
        body.add_site(name=f"s{i}", pos=place, quat=_along(axis))
        actuator = spec.add_actuator(name=f"u{i}", target=f"s{i}", trntype=mujoco.mjtTrn.mjTRN_SITE)
        actuator.gear = [0, 0, thrust, 0, 0, 0]
        actuator.ctrllimited, actuator.ctrlrange = True, [-1, 1]
    return names


def _along(axis: np.ndarray) -> np.ndarray:
    """A quaternion that turns z to this axis."""
    turn = np.zeros(4)
    mujoco.mju_quatZ2Vec(turn, axis / np.linalg.norm(axis))
    return turn


def _tree(draft: _Draft) -> list[str]:
    """A tree of hinges that hangs from the world."""
    return _links(draft, draft.spec.worldbody, None, np.zeros(3), int(draft.rng.integers(1, 5)), scale=1.0)


def _rail(draft: _Draft) -> list[str]:
    """A carriage on a rail, with links below it."""
    rng = draft.rng
    body = draft.spec.worldbody.add_body(name="b0")
    body.add_joint(name="j0", type=JOINT.mjJNT_SLIDE, axis=[1, 0, 0], damping=[rng.uniform(1, 6), 0, 0])
    # Held by a spring, as a rope drive would.
    body.joints[0].stiffness = [rng.uniform(5, 30), 0, 0]
    body.add_geom(
        name="b0_shape",
        type=GEOM.mjGEOM_BOX,
        pos=rng.normal(0, 0.01, 3),
        size=[0.1, 0.08, 0.05],
        mass=rng.uniform(1, 4),
        contype=0,
        conaffinity=0,
    )
    draft.joints.append("j0")
    return ["b0", *_links(draft, body, "b0", np.array([0, 0, -0.05]), int(rng.integers(0, 3)), scale=0.8)]


def _links(
    draft: _Draft, parent, parent_name, at: np.ndarray, count: int, *, scale: float, neutral: bool = False
) -> list[str]:
    """Links below `parent`, each from the one before or, now and then, from an earlier one."""
    rng = draft.rng
    made = [(parent, at)]
    names = []
    first = len(draft.spec.bodies) - 1
    for i in range(count):
        above, place = made[-1] if rng.random() < 0.75 else made[int(rng.integers(len(made)))]
        length, thick = scale * rng.uniform(0.15, 0.4), scale * rng.uniform(0.03, 0.07, 2)
        name = f"b{first + i}"
        body = above.add_body(name=name, pos=place)
        # Mostly across, so that gravity brings it back.
        axis = rng.normal(0, 1, 3) * [1, 1, 0.3]
        joint = body.add_joint(name=f"j{first + i}", type=JOINT.mjJNT_HINGE, axis=axis / np.linalg.norm(axis))
        size = np.array([*thick, length / 2])
        density = 1000.0 if neutral else rng.uniform(800, 2500)
        _hull(draft, body, name, size, np.array([0, 0, -length / 2]), density)
        if neutral or (draft.wet and rng.random() < 0.5):
            body.gravcomp = 1.0 if neutral else rng.uniform(0.3, 1.0)
        mass = density * 4 / 3 * np.pi * size.prod()
        typical = mass * length**2 / 3
        joint.damping = [typical * rng.uniform(0.5, 3.0), 0, 0]
        if rng.random() < 0.4 or neutral:
            joint.stiffness = [typical * rng.uniform(5, 40), 0, 0]
        if rng.random() < 0.3:
            joint.armature = typical * rng.uniform(0.05, 0.3)
        draft.joints.append(joint.name)
        names.append(name)
        made.append((body, np.array([0, 0, -length])))
    return names


def _drive_joints(draft: _Draft, *, servo: bool, pace: float) -> np.ndarray:
    """Motors or servos on the joints, behind what drives already; returns how far each is driven [nu]."""
    rng, spec = draft.rng, draft.spec
    had = [1.0] * len(spec.actuators)
    if not draft.joints:
        return np.array(had)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    felt = 1 / np.linalg.inv(full).diagonal()
    # How hard gravity turns it back, a radian from here.
    pull = np.zeros(model.nv)
    for name in draft.joints:
        joint = model.joint(name)
        data.qpos[:] = model.qpos0
        data.qpos[joint.qposadr[0]] += 1.0
        mujoco.mj_forward(model, data)
        pull[joint.dofadr[0]] = abs(data.qfrc_bias[joint.dofadr[0]] - data.qfrc_passive[joint.dofadr[0]])
    # One joint in five is not driven, but for the first.
    for i, name in enumerate(draft.joints):
        if i and rng.random() < 0.2:
            continue
        dof = model.joint(name).dofadr[0]
        slide = model.joint(name).type[0] == JOINT.mjJNT_SLIDE
        travel = rng.uniform(0.1, 0.25) if slide else rng.uniform(0.3, 0.8)
        actuator = spec.add_actuator(name=f"u{len(had)}", target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        if servo:
            actuator.set_to_position(kp=float(felt[dof] * pace**2), kv=float(2 * 0.8 * felt[dof] * pace))
            had.append(travel)
        else:
            actuator.gear[0] = travel * (pull[dof] + felt[dof] * (0.5 * pace) ** 2 * 0.5)
            actuator.ctrllimited, actuator.ctrlrange = True, [-1, 1]
            had.append(0.7)
    return np.array(had)


def _sensors(draft: _Draft, kind: str, base: str) -> None:
    """A random suite: often something that one would wish for is not there."""
    rng, spec = draft.rng, draft.spec

    def add(name, sensor, objtype, objname):
        noise = NOISE[sensor] * np.exp(rng.uniform(-1.1, 1.1))
        spec.add_sensor(name=name, type=sensor, objtype=objtype, objname=objname, noise=float(f"{noise:.3g}"))

    spec.body(base).add_site(name="imu", pos=rng.normal(0, 0.03, 3))
    if kind == "float":
        wanted = {
            "position": (SENSOR.mjSENS_FRAMEPOS, OBJECT.mjOBJ_XBODY, base),
            "attitude": (SENSOR.mjSENS_FRAMEQUAT, OBJECT.mjOBJ_XBODY, base),
            "gyro": (SENSOR.mjSENS_GYRO, OBJECT.mjOBJ_SITE, "imu"),
            "dvl": (SENSOR.mjSENS_VELOCIMETER, OBJECT.mjOBJ_SITE, "imu"),
            "accelerometer": (SENSOR.mjSENS_ACCELEROMETER, OBJECT.mjOBJ_SITE, "imu"),
        }
        chosen = {name for name in wanted if rng.random() < 0.7}
        chosen |= {str(rng.choice(["position", "dvl"])), str(rng.choice(["attitude", "gyro"]))}
        for name, (sensor, objtype, objname) in wanted.items():
            if name in chosen:
                add(name, sensor, objtype, objname)
    for i, joint in enumerate(draft.joints):
        # The first of a mechanism is always measured.
        if rng.random() < 0.85 or (i == 0 and kind != "float"):
            add(f"{joint}_pos", SENSOR.mjSENS_JOINTPOS, OBJECT.mjOBJ_JOINT, joint)
        if rng.random() < 0.6:
            add(f"{joint}_vel", SENSOR.mjSENS_JOINTVEL, OBJECT.mjOBJ_JOINT, joint)
    if kind != "float":
        for name, share, sensor in (
            ("gyro", 0.3, SENSOR.mjSENS_GYRO),
            ("accelerometer", 0.2, SENSOR.mjSENS_ACCELEROMETER),
        ):
            if rng.random() < share:
                add(name, sensor, OBJECT.mjOBJ_SITE, "imu")
        if rng.random() < 0.25:
            add("tip", SENSOR.mjSENS_FRAMEPOS, OBJECT.mjOBJ_XBODY, base)

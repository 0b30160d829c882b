"""Changes that make an MJCF the nominal of a case. Each says what it takes away and why.

Every nominal has: explicit inertias (as the compiler finds them), so that meshes, textures and skins can go and the
file stands alone; no contacts (truth and nominal would meet the floor at other instants; no case is about that); names
for what has none.
"""

from pathlib import Path

import mujoco
import numpy as np

HINGE, SLIDE, FREE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_FREE
SENSOR, OBJECT = mujoco.mjtSensor, mujoco.mjtObj


def bare(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Without meshes, textures, contacts; inertias explicit; bodies, joints, actuators named."""
    _names(spec)
    model = spec.compile()
    for body in spec.bodies[1:]:
        i = model.body(body.name).id
        body.explicitinertial = True
        body.mass, body.ipos, body.iquat = model.body_mass[i], model.body_ipos[i], model.body_iquat[i]
        body.inertia, body.fullinertia = model.body_inertia[i], np.full(6, np.nan)
    for geom in list(spec.geoms):
        world = geom.parent == spec.worldbody
        if geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF) or world:
            spec.delete(geom)
            continue
        geom.contype = geom.conaffinity = 0
        geom.mass, geom.density = 0.0, 0.0
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    _gone(spec, "skins", "pairs", "excludes", "meshes", "hfields", "keys", "numerics", "texts", "textures")
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.compiler.discardvisual = False
    spec.compiler.meshdir = spec.compiler.texturedir = ""
    return spec


def load(path: Path) -> mujoco.MjSpec:
    """An MJCF without cameras and lights."""
    spec = mujoco.MjSpec.from_file(str(path))
    _gone(spec, "cameras", "lights")
    return spec


def _gone(spec: mujoco.MjSpec, *lists: str) -> None:
    for name in lists:
        for element in list(getattr(spec, name)):
            spec.delete(element)


def _names(spec: mujoco.MjSpec) -> None:
    for what, items in (("body", spec.bodies[1:]), ("joint", spec.joints), ("actuator", spec.actuators)):
        for i, element in enumerate(items):
            # Effects and columns of a log go by name.
            element.name = element.name or f"{what}_{i}"


def on_a_stand(spec: mujoco.MjSpec, *others: str) -> None:
    """A walker without its free joint, as it hangs from a stand; `others`: bodies that go (a ball on the floor)."""
    for name in others:
        spec.delete(spec.body(name))
    for joint in list(spec.joints):
        if joint.type == FREE:
            spec.delete(joint)


def without_limits(spec: mujoco.MjSpec) -> None:
    """Joints and tendons without stops, where the robot hangs in them at rest: a stop is a contact."""
    for joint in spec.joints:
        joint.limited = False
    for tendon in spec.tendons:
        tendon.limited = False


def springs_for_stops(spec: mujoco.MjSpec, push: float) -> None:
    """Springs about the middle of each range in place of the stops, where joints hang in them.

    As strong as gravity and all actuators at command `push` together at a quarter of the range from there.
    """
    for i, joint in enumerate(spec.joints):
        joint.name = joint.name or f"joint_{i}"
    model = spec.compile()
    data = mujoco.MjData(model)
    middle = model.qpos0.copy()
    for j in range(model.njnt):
        if model.jnt_limited[j]:
            middle[model.jnt_qposadr[j]] = model.jnt_range[j].mean()
    data.qpos[:] = middle
    mujoco.mj_forward(model, data)
    load = np.abs(data.qfrc_bias)
    moment = np.zeros((model.nu, model.nv))
    mujoco.mju_sparse2dense(moment, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind)
    load += push * np.abs(moment).T @ np.abs(model.actuator_gainprm[:, 0])
    for joint in spec.joints:
        own = model.joint(joint.name)
        if model.jnt_limited[own.id]:
            low, high = model.jnt_range[own.id]
            stiff = 4 * load[own.dofadr[0]] / (high - low)
            joint.stiffness = [max(stiff, float(joint.stiffness[0])), 0, 0]
            joint.springref = np.degrees(middle[own.qposadr[0]]) if spec.compiler.degree else middle[own.qposadr[0]]
    without_limits(spec)


def held(spec: mujoco.MjSpec, *names: str) -> None:
    """Joints that others hold by enormous damping are welded."""
    for name in names:
        spec.delete(spec.joint(name))


def servos(spec: mujoco.MjSpec, joints: list[str], qpos: np.ndarray, pace: float = 35.0, damping: float = 0.8) -> None:
    """Position servos in place of what drives these joints: the servo that others have in software (or a mocap body).

    Gains for a natural frequency of `pace` rad/s with the inertia that each joint feels at `qpos` where all others are
    free: what a stiffer servo would do at the wrists, Runge-Kutta at 2 ms would not follow.
    """
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    felt = 1 / np.linalg.inv(full).diagonal()
    for name in joints:
        inertia = felt[model.joint(name).dofadr[0]]
        actuator = spec.add_actuator(name=f"servo_{name}", target=name)
        actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
        actuator.set_to_position(kp=float(inertia * pace**2), kv=float(2 * damping * inertia * pace))


def encoders(spec: mujoco.MjSpec, position: float, velocity: float | None, but: tuple[str, ...] = ()) -> None:
    """Encoders [rad] or [m], and speeds where `velocity` is given, of every hinge and slide that has none."""
    had = {(s.type, s.objname) for s in spec.sensors}
    for joint in spec.joints:
        if joint.type not in (HINGE, SLIDE) or joint.name in but:
            continue
        for kind, word, noise in ((SENSOR.mjSENS_JOINTPOS, "pos", position), (SENSOR.mjSENS_JOINTVEL, "vel", velocity)):
            if noise is not None and (kind, joint.name) not in had:
                spec.add_sensor(
                    name=f"{joint.name}_{word}", type=kind, objtype=OBJECT.mjOBJ_JOINT, objname=joint.name, noise=noise
                )


def own_sensors(spec: mujoco.MjSpec, noise: dict) -> None:
    """Of the robot's own sensors those of these types stay, with this noise; the others go."""
    for sensor in list(spec.sensors):
        if sensor.type in noise:
            sensor.noise = noise[sensor.type]
        else:
            spec.delete(sensor)


def tracked(spec: mujoco.MjSpec, body: str, position: float, attitude: float) -> None:
    """A camera system that tracks a free body."""
    for name, kind, noise in (
        ("position", SENSOR.mjSENS_FRAMEPOS, position),
        ("attitude", SENSOR.mjSENS_FRAMEQUAT, attitude),
    ):
        spec.add_sensor(name=name, type=kind, objtype=OBJECT.mjOBJ_XBODY, objname=body, noise=noise)

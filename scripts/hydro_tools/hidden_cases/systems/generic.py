"""A system made from any MJCF: excitation and sizes of effects from what its nominal does in a short pilot run.

The truth steps at a quarter of the nominal's step. Strangers' robots and random systems are such systems.
"""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from .. import HiddenCaseError, excitation
from ..effects import actuator, drag, inertial, joint, lift, memory, sensor, water, weight
from ..effects.backlash import JointBacklash
from ..frames import exponential, product, rotation
from ..plant import Plant
from ..scenes import with_noise, without_noise
from ..strength import Layout
from .base import Drive, Schedule, System, Twin

SENSOR = mujoco.mjtSensor
HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
#: Units of a sensor's bias by its type.
UNITS = {
    SENSOR.mjSENS_JOINTVEL: "rad/s",
    SENSOR.mjSENS_GYRO: "rad/s",
    SENSOR.mjSENS_VELOCIMETER: "m/s",
    SENSOR.mjSENS_ACCELEROMETER: "m/s^2",
    SENSOR.mjSENS_FORCE: "N",
    SENSOR.mjSENS_TORQUE: "N m",
}
#: Distance from a joint's limit that the truth keeps, as a part of its range.
MARGIN = 0.01


@dataclass
class Robot:
    """A nominal and how it is driven. Arrays over actuators [nu] in units of the control."""

    name: str
    xml: str
    base: str  # body on which effects on a body act
    qpos: np.ndarray  # [nq] in the middle of the motion
    middle: np.ndarray  # [nu] commands about which it is driven
    reach: np.ndarray  # [nu]
    period: float  # s, of a row
    seconds: tuple[float, float] = (10.0, 6.0)  # of a trial; of a quick one
    band: tuple[float, float] = (0.15, 1.5)  # Hz
    #: Feedback that keeps a joint in its range: actuator -> (joint, control per unit of position, per unit of speed).
    hold: dict[int, tuple[str, float, float]] = field(default_factory=dict)
    com: float = 0.002
    spread: float = 0.05  # of the start about qpos, joints [rad] or [m]
    effects: tuple[str, ...] = ()  # the only ones that are hidden, where given
    #: Step of the truth as a part of the nominal's, and whether it is taken by Runge-Kutta.
    part: int = 4
    runge_kutta: bool = True
    noise_declared: bool = True
    command_noise: float = 0.0  # standard deviation of the white noise that commands are logged with
    #: Least and most factor on the base parameters of an effect, where no strength is aimed at: what disturbs the cases
    #: most is then another thing than the sensors' noise.
    factors: tuple[float, float] | None = None


class Generic(System):
    """See the module."""

    # An accelerometer on a light link that is driven hard shows the filter itself: a gap where nothing is missing.
    filtered = False

    def __init__(self, robot: Robot):
        self.robot, self.name, self.base, self.com = robot, robot.name, robot.base, robot.com
        self.command_noise = robot.command_noise
        self.model = self.plain_model(robot.xml)
        self.most_nuisances = 90
        self.bodies = {self.model.body(b).name: b for b in range(1, self.model.nbody)}
        self.layout = Layout.from_model(self.model)
        self._sizes: dict | None = None

    def nominal_xml(self, noise):
        return with_noise(self.robot.xml, noise)

    def shown_xml(self, xml):
        return xml if self.robot.noise_declared else without_noise(xml)

    def tie(self, name):
        """Bodies of a small robot stand alone, those of a large one in eight classes along the tree."""
        many = len(self.bodies)
        return name if many <= 13 else f"part {8 * (self.bodies[name] - 1) // many}"

    def truth_step(self, rng):
        kind = mujoco.mjtIntegrator.mjINT_RK4 if self.robot.runge_kutta else mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        return self.model.opt.timestep / self.robot.part, int(kind)

    def schedule(self, rng, *, small):
        long, short = self.robot.seconds
        rows = round((short if small else long) / self.robot.period)
        return Schedule(4 if small else 8, rows, self.robot.period)

    def drive(self, rng, model, schedule, style):
        robot, m, rows, nu = self.robot, schedule.trials, schedule.rows, model.nu
        # Servos follow the same table in less time; the others push harder.
        quick = schedule.speed if self._servos() else 1.0
        hard = 1.0 if self._servos() else schedule.speed
        period = schedule.period * quick
        low, high = robot.band
        table = np.zeros((m, rows + 1, nu))
        modes = []
        for i in range(m):
            mode = _MODES[i % len(_MODES)]
            modes.append(mode)
            size = schedule.size(rng, 0.6, 1.0) * hard
            if mode == "multisine":
                table[i] = excitation.multisine(rng, rows + 1, period, nu, lowest=low, highest=high) * size
            elif mode == "slow":
                table[i] = excitation.multisine(rng, rows + 1, period, nu, lowest=low / 2, highest=low * 2, tones=3)
                table[i] *= size
            elif mode == "steps":
                steps = excitation.steps(rng, rows + 1, period, nu, hold=1.2 / high + 0.3)
                table[i] = _soft(steps, max(round(0.3 / high / period), 3)) * size
            else:
                table[i] = 0.3 * size * excitation.multisine(rng, rows + 1, period, nu, lowest=low, highest=high)
                for which in rng.permutation(nu)[: max(1, nu // 4)]:
                    chirp = excitation.chirp(rng, rows + 1, period, lowest=low, highest=high)
                    table[i, :, which] = chirp * size
        policy = _Table(model, robot, robot.middle + table * robot.reach, rng.normal(0, 1e-3, (m, rows + 1, nu)))
        qpos = np.tile(robot.qpos, (m, 1))
        for j in range(model.njnt):
            at = model.jnt_qposadr[j]
            if model.jnt_type[j] in (HINGE, SLIDE):
                qpos[:, at] += np.clip(rng.normal(0, robot.spread, m), -2 * robot.spread, 2 * robot.spread)
            elif model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE:
                turn = np.zeros((m, 3))
                turn[:, 2] = rng.uniform(-np.pi, np.pi, m)
                lean = rng.normal(0, robot.spread, (m, 3)) * [1, 1, 0]
                qpos[:, at + 3 : at + 7] = product(exponential(turn), exponential(lean))
        return Drive(qpos, np.zeros((m, model.nv)), policy, modes, np.zeros((m, model.na)))

    def check(self, model, record):
        for j in range(model.njnt):
            if model.jnt_limited[j] and model.jnt_type[j] in (HINGE, SLIDE):
                low, high = model.jnt_range[j]
                q = record.qpos[:, :, model.jnt_qposadr[j]]
                keep = MARGIN * (high - low)
                if q.min() < low + keep or q.max() > high - keep:
                    raise HiddenCaseError(
                        f"{self.name}: joint {model.joint(j).name} comes to {q.min():.3g}..{q.max():.3g} of its limits "
                        f"{low:.3g}..{high:.3g}"
                    )
        if np.abs(record.qvel).max() > 200:
            raise HiddenCaseError(f"{self.name}: speeds up to {np.abs(record.qvel).max():.3g}")

    def known_position(self, rng, qpos, layout):
        known = super().known_position(rng, qpos, layout)
        for i in range(self.model.nsensor):
            if self.model.sensor_type[i] == SENSOR.mjSENS_JOINTPOS:
                at = self.model.jnt_qposadr[self.model.sensor_objid[i]]
                known[at] += rng.normal(0, layout.noise[self.model.sensor(i).name] / 3)
        return known

    def _servos(self) -> bool:
        return bool(np.all(self.model.actuator_biasprm[:, 1] != 0)) and self.model.nu > 0

    def sizes(self) -> dict:
        """What the nominal does when driven: per joint force, speed, travel; of the base force, speed, turning."""
        if self._sizes is None:
            model = self.model
            drive = self.drive(np.random.default_rng(5), model, Schedule(2, 200, self.robot.period), "normal")
            plant = Plant(model, [], qpos=drive.qpos, qvel=drive.qvel, start=np.zeros(2), act=drive.act)
            record = plant.run(
                200, self.robot.period, drive.policy, record_every=round(self.robot.period / model.opt.timestep)
            )
            data, body = mujoco.MjData(model), self.bodies[self.base]
            qvel = record.qvel.reshape(-1, model.nv)
            qacc = np.gradient(record.qvel, self.robot.period, axis=1).reshape(-1, model.nv)
            qpos = record.qpos.reshape(-1, model.nq)
            twists = np.zeros((len(qvel), 6))
            for k in range(0, len(qvel), 4):
                data.qpos[:], data.qvel[:] = qpos[k], qvel[k]
                mujoco.mj_forward(model, data)
                mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twists[k], 1)
            inertia = np.zeros((model.nv, model.nv))
            mujoco.mj_fullM(model, data, inertia)
            twists = twists[::4]
            rms = lambda a: np.sqrt((a**2).mean(0)) + 1e-9  # noqa: E731
            free = model.body_dofnum[body] == 6
            mass = model.body_subtreemass[body] if free else model.body_mass[body]
            turning = model.body_inertia[body].mean() if not free else inertia.diagonal()[3:6].mean()
            pace = 2 * np.pi * np.sqrt(self.robot.band[0] * self.robot.band[1])
            self._sizes = {
                "force": inertia.diagonal() * rms(qacc),
                "moved": inertia.diagonal().copy(),
                "speed": rms(qvel),
                "travel": qpos.std(0) + 1e-9,
                "middle": qpos.mean(0),
                "mass": mass,
                "inertia": turning,
                "linear": rms(twists[:, 3:]).max(),
                "angular": rms(twists[:, :3]).max(),
                "pace": pace,
            }
        return self._sizes

    def singles(self, model):
        found = self._joints(model) | self._actuators(model) | self._body(model) | self._sensors(model)
        if self.robot.effects:
            found = {kind: factory for kind, factory in found.items() if kind in self.robot.effects}
        return found

    def rivals(self, model, effect):
        found = self.singles(model)
        if effect.kind == "joint_damping":
            # Drag of the link that turns in it; on a hinge of the world they are the same thing.
            j = model.joint(effect.target).id
            body = int(model.jnt_bodyid[j])
            size = np.append(np.full(3, 1.0), np.full(3, 0.1)) * effect.value("damping")
            found["linear_drag"] = lambda rng: drag.LinearDrag(model.body(body).name, body, size)
        return found

    def _joints(self, model) -> dict:
        size = self.sizes()
        joints = [j for j in range(model.njnt) if model.jnt_type[j] in (HINGE, SLIDE)]
        # Those that move.
        joints = [j for j in joints if size["travel"][model.jnt_qposadr[j]] > 1e-4]
        if not joints:
            return {}

        def one(rng, joints=joints):
            j = joints[int(rng.integers(len(joints)))]
            dof = int(model.jnt_dofadr[j])
            return model.joint(j).name, dof, int(model.jnt_qposadr[j]), model.jnt_type[j] == SLIDE

        def renamed(effect, slide, pairs):
            if slide:
                effect.parameters = {
                    name: (value, pairs.get(unit, unit)) for name, (value, unit) in effect.parameters.items()
                }
            return effect

        line = {"N m": "N", "N m s/rad": "N s/m", "N m/rad": "N/m", "rad": "m", "kg m^2": "kg"}

        def friction(rng):
            name, dof, at, slide = one(rng)
            # A sign as smooth as elsewhere is a damping for a joint that creeps.
            smooth = min(0.02, 0.1 * float(size["speed"][dof]))
            return renamed(joint.JointFriction(name, dof, at, 0.1 * size["force"][dof], smooth), slide, line)

        def damping(rng):
            name, dof, at, slide = one(rng)
            return renamed(
                joint.JointDamping(name, dof, at, 0.1 * size["force"][dof] / size["speed"][dof]), slide, line
            )

        def stiffness(rng):
            name, dof, at, slide = one(rng)
            rest = float(size["middle"][at] + rng.normal(0, 0.5) * size["travel"][at])
            return renamed(
                joint.JointStiffness(name, dof, at, 0.1 * size["force"][dof] / size["travel"][at], rest), slide, line
            )

        out = {"joint_friction": friction, "joint_damping": damping, "joint_stiffness": stiffness}
        drives = [
            (i, int(model.actuator_trnid[i, 0]))
            for i in range(model.nu)
            if model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        ]
        drives = [(i, j) for i, j in drives if j in joints]
        if drives:

            def armature(rng):
                name, dof, at, slide = one(rng, [j for _, j in drives])
                return renamed(joint.JointArmature(name, dof, at, 0.1 * size["moved"][dof]), slide, line)

            out["joint_armature"] = armature
        servos = [(i, j) for i, j in drives if model.actuator_biasprm[i, 1] != 0]
        if servos:

            def backlash(rng):
                i, j = servos[int(rng.integers(len(servos)))]
                play = 0.1 * float(self.robot.reach[i])
                effect = JointBacklash(model.joint(j).name, j, play, i)
                effect.most = 5.0
                return renamed(effect, model.jnt_type[j] == SLIDE, line)

            out["joint_backlash"] = backlash
        return out

    def _actuators(self, model) -> dict:
        names = [model.actuator(i).name for i in range(model.nu)]
        if not names:
            return {}

        def one(rng):
            i = int(rng.integers(model.nu))
            return names[i], [i]

        def some(rng):
            return ("all", list(range(model.nu))) if rng.random() < 0.5 else one(rng)

        def deadband(rng):
            name, which = some(rng)
            width = 0.1 * float(np.min(self.robot.reach[which]))
            effect = actuator.ActuatorDeadband(name, which, width)
            effect.most = 0.6 * float(np.min(self.robot.reach[which])) / width
            return effect

        out = {
            "actuator_gain": lambda rng: actuator.ActuatorGain(*one(rng), rng.choice([-1.0, 1.0]) * 0.1),
            "actuator_lag": lambda rng: actuator.ActuatorLag(*some(rng), 3 * self.robot.period),
            "actuator_delay": lambda rng: actuator.ActuatorDelay(*some(rng), 2 * self.robot.period),
        }
        if not self._servos() and not model.na:
            out["actuator_deadband"] = deadband
        if self._floats(model) and (model.actuator_trntype == mujoco.mjtTrn.mjTRN_SITE).any():
            sites = model.actuator_trnid[:, 0]
            which = [i for i in range(model.nu) if model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_SITE]
            which = [i for i in which if model.site_bodyid[sites[i]] == self.bodies[self.base]]
            sites = sites[which]
            if which:
                out["inflow_thrust_loss"] = lambda rng: actuator.InflowThrustLoss(
                    "all" if len(which) == model.nu else names[which[0]],
                    which if len(which) == model.nu else which[:1],
                    0.15 / self.sizes()["linear"],
                    body=self.bodies[self.base],
                    directions=rotation(model.site_quat[sites])[:, :, 2],
                    places=model.site_pos[sites],
                )
        return out

    def _floats(self, model) -> bool:
        return model.body_dofnum[self.bodies[self.base]] == 6

    def _body(self, model) -> dict:
        size, name, body = self.sizes(), self.base, self.bodies[self.base]
        mass, turning, v, w = size["mass"], size["inertia"], size["linear"], size["angular"]
        force, torque = mass * v * size["pace"], turning * w * size["pace"]
        extent = np.sqrt(turning / mass) + 1e-3

        def six(rng, linear, angular):
            # A body that does not turn says nothing about what turning costs.
            values = np.concatenate([np.full(3, linear), np.full(3, angular if w > 1e-3 else 0.0)])
            return values * rng.uniform(0.5, 1.5, 6)

        def way(rng, *, flat=True):
            axis = rng.normal(0, 1, 3) * ([1, 1, 0.2] if flat else [1, 1, 1])
            return axis / np.linalg.norm(axis)

        out = {
            "payload": lambda rng: weight.Payload(name, body, 0.1 * mass, way(rng, flat=False) * extent),
            "constant_force": lambda rng: weight.ConstantForce(name, body, 0.2 * force * way(rng) * [1, 1, 0]),
            "linear_drag": lambda rng: drag.LinearDrag(name, body, six(rng, 0.3 * force / v, 0.3 * torque / w)),
            "quadratic_drag": lambda rng: drag.QuadraticDrag(
                name, body, six(rng, 0.3 * force / v**2, 0.3 * torque / w**2)
            ),
        }
        for effect in ("payload", "linear_drag", "quadratic_drag"):
            out[effect] = _at_most(out[effect], 5.0)
        if self._floats(model):
            out |= {
                "added_mass": _at_most(
                    lambda rng: inertial.AddedMass(name, body, six(rng, 0.3 * mass, 0.3 * turning)), 4.0
                ),
                "munk_moment": lambda rng: inertial.MunkMoment(
                    name, body, np.append(rng.uniform(0, 0.6, 3) * mass, [0, 0, 0])
                ),
                "net_buoyancy": lambda rng: weight.NetBuoyancy(
                    name, body, rng.choice([-1.0, 1.0]) * 0.3 * force, model.body_ipos[body]
                ),
                "buoyancy_offset": lambda rng: weight.BuoyancyOffset(
                    name, body, rng.normal(0, 0.03, 3) * extent + [0, 0, 0.05 * extent], mass * weight.GRAVITY
                ),
                "wake_memory": lambda rng: memory.WakeMemory(
                    name, body, six(rng, 0.3 * force / v, 0.3 * torque / w), rng.uniform(0.3, 1.5) * size["pace"]
                ),
                "basset_history": lambda rng: memory.BassetHistory(
                    name, body, 0.3 * force / v / np.sqrt(size["pace"]), axes=rng.uniform(0.6, 1.4, 3)
                ),
                "lift": lambda rng: lift.Lift(
                    name, body, area=0.2 * force / (500 * v**2), slope=rng.uniform(0.8, 1.4), along=0
                ),
            }
        if model.opt.density > 0 or model.opt.viscosity > 0:
            out["current"] = lambda rng: water.Current(name, body, 0.4 * v * way(rng), rng.uniform(0, 6))
        return out

    def _sensors(self, model) -> dict:
        kinds = {model.sensor(i).name: SENSOR(model.sensor_type[i]) for i in range(model.nsensor)}
        width = {model.sensor(i).name: int(model.sensor_dim[i]) for i in range(model.nsensor)}
        noise = {model.sensor(i).name: float(model.sensor_noise[i]) for i in range(model.nsensor)}
        slides = {
            model.sensor(i).name
            for i in range(model.nsensor)
            if kinds[model.sensor(i).name] == SENSOR.mjSENS_JOINTVEL and model.jnt_type[model.sensor_objid[i]] == SLIDE
        }
        # A position's bias is taken up by the start; what a joint's speed is off by shows.
        biased = [name for name, kind in kinds.items() if kind in UNITS]
        late = [name for name, kind in kinds.items() if kind not in (SENSOR.mjSENS_FRAMEQUAT,)]
        scaled = [name for name in biased if kinds[name] != SENSOR.mjSENS_ACCELEROMETER]

        def pick(rng, names):
            return names[int(rng.integers(len(names)))]

        out = {}
        if biased:

            def bias(rng):
                name = pick(rng, biased)
                unit = "m/s" if name in slides else UNITS[kinds[name]]
                bias = rng.normal(0, 0.5 * noise[name], width[name])
                return sensor.SensorBias(name, bias, unit)

            out["sensor_bias"] = bias
        if scaled:
            out["sensor_scale"] = lambda rng: sensor.SensorScale(pick(rng, scaled), rng.choice([-1.0, 1.0]) * 0.05)
        if late:
            out["sensor_delay"] = lambda rng: sensor.SensorDelay(pick(rng, late), 1.5 * self.robot.period)
        return out

    def outside(self, model):
        return {}

    def twins(self, model) -> dict[str, Twin]:
        return {}


_MODES = ("multisine", "steps", "chirp", "slow")


def _at_most(factory, most: float):
    def made(rng):
        effect = factory(rng)
        effect.most = most
        return effect

    return made


def _soft(table: np.ndarray, width: int) -> np.ndarray:
    """Edges of `width` rows."""
    kernel = np.hanning(width + 2)
    kernel /= kernel.sum()
    return np.stack([np.convolve(column, kernel)[: len(column)] for column in table.T], 1)


class _Table:
    """Commands from a table, with feedback where a joint must be kept in its range."""

    def __init__(self, model, robot: Robot, table, noise):
        self.table, self.noise = table, noise
        limited = model.actuator_ctrllimited.astype(bool)
        self.low = np.where(limited, model.actuator_ctrlrange[:, 0], -np.inf)
        self.high = np.where(limited, model.actuator_ctrlrange[:, 1], np.inf)
        self.hold = [
            (i, model.jnt_qposadr[model.joint(name).id], model.jnt_dofadr[model.joint(name).id], kp, kd)
            for i, (name, kp, kd) in robot.hold.items()
        ]
        self.rest = robot.qpos

    def tiled(self, count: int) -> "_Table":
        """The same trials `count` times over."""
        other = object.__new__(_Table)
        other.__dict__ = dict(self.__dict__)
        other.table, other.noise = np.tile(self.table, (count, 1, 1)), np.tile(self.noise, (count, 1, 1))
        return other

    def __call__(self, row, plant):
        asked = self.table[:, row].copy()
        for i, at, dof, kp, kd in self.hold:
            off = plant.qpos[:, at] - self.rest[at] + self.noise[:, row, i]
            asked[:, i] -= kp * off + kd * plant.qvel[:, dof]
        return np.clip(asked, self.low, self.high)

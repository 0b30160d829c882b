"""Play between a servo's motor and what it moves."""

import mujoco
import numpy as np

from .base import Effect

#: Inertia of a motor whose model has none, in parts of what it moves.
ROTOR = 0.01
#: Natural frequency [rad/s] of what the joint moves on the teeth that are in contact, and their damping ratio.
TEETH, RATIO = 2 * np.pi * 60, 0.5
#: Longest substep, in parts of the inverse natural frequency of the motor on the teeth.
SUBSTEP = 0.2
#: Smallest play [rad or m]: the teeth alone give way by a part of it.
LEAST = 2e-3


class JointBacklash(Effect):
    """Motor and link with a dead zone between them (Nordin and Gutman 2002, section 2.2).

    The motor has the servo's loop and the joint's sensors. Teeth of finite stiffness and damping carry the torque
    where they touch.
    """

    kind = "joint_backlash"

    def __init__(self, target: str, joint: int, play: float, actuator: int):
        super().__init__(target, {"play": (play, "rad")})
        self.joint, self.actuator, self.play = joint, actuator, play
        self.least, self.most = LEAST / play, 0.15 / play

    def begin(self, plant):
        model, members = plant.model, plant.members
        self.dof, self.at = int(model.jnt_dofadr[self.joint]), int(model.jnt_qposadr[self.joint])
        data = mujoco.MjData(model)
        data.qpos[:] = plant.qpos[0]
        mujoco.mj_forward(model, data)
        whole = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, whole)
        armature = model.dof_armature[self.dof]
        whole[self.dof, self.dof] -= armature
        #: What a torque at the joint alone has to turn [kg m^2].
        self.inertia = 1 / np.linalg.inv(whole)[self.dof, self.dof]
        self.rotor = armature if armature > 0 else ROTOR * self.inertia
        self.stiffness = self.inertia * TEETH**2
        self.damping = 2 * RATIO * np.sqrt(self.stiffness * self.rotor)
        self.friction = model.dof_damping[self.dof]
        self.half = np.broadcast_to(0.5 * self.scale[:, 0] * self.play, (members,))
        fastest = np.sqrt(self.stiffness / self.rotor)
        self.substeps = int(np.ceil(plant.step_length * fastest / SUBSTEP))
        self.angle, self.speed = plant.qpos[:, self.at].copy(), plant.qvel[:, self.dof].copy()
        # Rotor and bearing belong to the motor.
        plant.batch.expand("dof_armature").reshape(members, -1)[:, self.dof] = 0.0
        plant.batch.expand("dof_damping").reshape(members, -1)[:, self.dof] = 0.0
        self.servo, self.before = None, None
        columns = (model.sensor_objid == self.joint) & (model.sensor_objtype == mujoco.mjtObj.mjOBJ_JOINT)
        self.reads = {
            kind: model.sensor_adr[columns & (model.sensor_type == kind)]
            for kind in (mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtSensor.mjSENS_JOINTVEL)
        }

    def _take_servo(self, plant):
        """The servo's numbers as all effects have left them; the engine's own servo is silent from here on."""
        members, model = plant.members, plant.model
        gain = plant.batch.expand("actuator_gainprm").reshape(members, model.nu, -1)
        bias = plant.batch.expand("actuator_biasprm").reshape(members, model.nu, -1)
        self.servo = gain[:, self.actuator, 0].copy(), bias[:, self.actuator, :3].copy()
        gain[:, self.actuator], bias[:, self.actuator] = 0.0, 0.0

    def _torque(self, model, command, angle, speed):
        """The servo's torque at the motor."""
        (gain, bias), gear = self.servo, model.actuator_gear[self.actuator, 0]
        if model.actuator_ctrllimited[self.actuator]:
            command = np.clip(command, *model.actuator_ctrlrange[self.actuator])
        force = gain * command + bias[:, 0] + gear * (bias[:, 1] * angle + bias[:, 2] * speed)
        if model.actuator_forcelimited[self.actuator]:
            force = np.clip(force, *model.actuator_forcerange[self.actuator])
        return gear * force

    def force(self, plant):
        if self.servo is None:
            self._take_servo(plant)
        link, rate = plant.qpos[:, self.at].copy(), plant.qvel[:, self.dof].copy()
        # The rest of the link's acceleration is that of the step before.
        rest = np.zeros(plant.members)
        if self.before is not None:
            rest = (rate - self.before[0]) / plant.step_length - self.before[1] / self.inertia
        start = rate.copy()
        command, total = plant.ctrl[:, self.actuator], np.zeros(plant.members)
        step = plant.step_length / self.substeps
        at_start = None
        for _ in range(self.substeps):
            lead = self.angle - link
            depth = lead - np.clip(lead, -self.half, self.half)
            # Teeth push, they do not pull.
            pushed = self.stiffness * depth + self.damping * (self.speed - rate)
            carried = np.where(depth > 0, np.maximum(pushed, 0), np.where(depth < 0, np.minimum(pushed, 0), 0.0))
            own = self._torque(plant.model, command, self.angle, self.speed)
            if at_start is None:
                at_start = depth != 0, own - self.friction * self.speed
            # The servo's own damping is implicit: a motor alone is light.
            drag = self.friction - self.servo[1][:, 2] * plant.model.actuator_gear[self.actuator, 0] ** 2
            self.speed += step * (own - carried - self.friction * self.speed) / (self.rotor + step * drag)
            self.angle += step * self.speed
            rate += step * (rest + carried / self.inertia)
            link += step * rate
            total += carried / self.substeps
        self.before = start, total
        # Teeth in contact pass a new command on within a millisecond; the engine's own servos do at once.
        touching, given = at_start
        given = given - self.rotor * (rest + total / self.inertia)
        self.varies = np.where(touching, given, total) - total
        plant.qfrc[:, self.dof] += total

    def read(self, plant, sensors):
        for kind, value in zip(self.reads, (self.angle, self.speed)):
            sensors[:, self.reads[kind]] = value[:, None]

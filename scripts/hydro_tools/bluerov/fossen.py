"""Fossen's equations of M underwater vehicles at once, stepped by the classical Runge-Kutta scheme.

    eta' = J(eta) nu
    M_RB nu' + C_RB(nu) nu + M_A nu_r' + C_A(nu_r) nu_r + D(nu_r) nu_r + g(eta) = tau

T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, chapters 3, 6, 8 and 10.
nu = (v, omega) [M, 6] m/s, rad/s in the body's frame about its origin; nu_r = nu - (R^T v_c, 0). Here z is up in the
world and in the body: the matrices are the same in any right-handed frame, only g(eta) has the other sign. No MuJoCo.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from ..hidden_cases.frames import cross, exponential, product, rotation, turned, turned_back
from . import numbers


@dataclass(frozen=True)
class Vehicle:
    """Numbers of M vehicles; a leading 1 stands for all of them."""

    mass: np.ndarray  # [M, 1] kg
    inertia: np.ndarray  # [M, 3] kg m^2 about the centre of mass, principal axes
    centre: np.ndarray  # [M, 3] m, centre of mass
    added: np.ndarray  # [M, 6, 6] kg, kg m, kg m^2
    linear: np.ndarray  # [M, 6, 6] N s/m, N m s/rad
    quadratic: np.ndarray  # [M, 6] N s^2/m^2, N m s^2/rad^2, at `power` 1
    buoyancy: np.ndarray  # [M, 1] N
    buoyancy_centre: np.ndarray  # [M, 3] m
    current: np.ndarray  # [M, 3] m/s in the world
    gain: np.ndarray  # [M, n] N at command 1
    #: Drag q |nu|^power nu, equal to the square law at the speeds `reference`; a part `mixed` of |nu| is the norm.
    power: float = 1.0
    mixed: float = 0.0
    #: Part of the buoyancy that is lost a metre of depth beyond 2 m [1/m]; part by which the current wanders.
    squeeze: float = 0.0
    wander: float = 0.0
    configuration: str = "heavy"

    def replaced(self, **changes) -> "Vehicle":
        """The same with other numbers."""
        return replace(self, **changes)

    def stacked(self, others: list["Vehicle"], each: int) -> "Vehicle":
        """This one and others, `each` members of every one."""
        changes = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                every = [getattr(vehicle, field.name) for vehicle in (self, *others)]
                changes[field.name] = np.concatenate(
                    [np.broadcast_to(one, (each, *one.shape[1:])) if len(one) == 1 else one for one in every]
                )
        return replace(self, **changes)


#: Speeds [m/s], [rad/s] at which drag of any power is that of the square law.
REFERENCE = np.array([0.3, 0.3, 0.2, 0.6, 0.6, 0.8])


def public(configuration: str = "heavy") -> Vehicle:
    """One vehicle by the public numbers."""
    n = len(numbers.PLACES[configuration])
    return Vehicle(
        mass=np.array([[numbers.MASS]]),
        inertia=numbers.INERTIA[None].copy(),
        centre=np.zeros((1, 3)),
        added=np.diag(numbers.ADDED_MASS)[None],
        linear=np.diag(numbers.LINEAR_DRAG)[None],
        quadratic=numbers.QUADRATIC_DRAG[None].copy(),
        buoyancy=np.array([[numbers.DENSITY * numbers.VOLUME * numbers.GRAVITY]]),
        buoyancy_centre=numbers.BUOYANCY_CENTRE[None].copy(),
        current=np.zeros((1, 3)),
        gain=np.full((1, n), numbers.THRUST),
        configuration=configuration,
    )


def rigid_body(vehicle: Vehicle) -> np.ndarray:
    """M_RB [M, 6, 6] about the origin (Fossen 2021, equation 3.50)."""
    m, r = vehicle.mass[..., None], _skew(vehicle.centre)
    inertia = vehicle.inertia[:, :, None] * np.eye(3)
    top = np.concatenate([m * np.eye(3), -m * r], 2)
    bottom = np.concatenate([m * r, inertia - m * (r @ r)], 2)
    return np.concatenate([top, bottom], 1)


class Motion:
    """The right-hand side for vehicles that do not change: what can be computed once is."""

    def __init__(self, vehicle: Vehicle):
        self.vehicle = vehicle
        self.rigid = rigid_body(vehicle)
        self.inverse = np.linalg.inv(self.rigid + vehicle.added)
        unit = numbers.allocation(vehicle.configuration) / numbers.THRUST
        self.thrust = unit.T[None] * vehicle.gain[:, :, None]  # [M, n, 6]
        self.linear = np.swapaxes(vehicle.linear, 1, 2)
        self.drag = vehicle.quadratic * REFERENCE ** (1.0 - vehicle.power)
        self.moves = bool(np.any(vehicle.current))

    def tau(self, commands: np.ndarray) -> np.ndarray:
        """Wrench of the thrusters [M, 6] of commands [M, n]."""
        return np.matmul(commands[:, None, :], self.thrust)[:, 0]

    def water(self, position: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Velocity of the water in the world [M, 3] m/s."""
        vehicle = self.vehicle
        if vehicle.wander == 0.0:
            return np.broadcast_to(vehicle.current, position.shape)
        slow = 1 + vehicle.wander * np.sin(2 * np.pi * time / 31.0 + 1.0) + 0.01 * (position[:, 2] + 2.0)
        return slow[:, None] * vehicle.current

    def acceleration(self, position, turn, nu, tau, time) -> np.ndarray:
        """nu' [M, 6] at positions [M, 3] m, `world_from_body` [M, 3, 3], nu [M, 6], wrench tau [M, 6], times [M] s."""
        vehicle = self.vehicle
        omega = nu[:, 3:]
        force = tau - _coriolis(self.rigid, nu)
        if self.moves:
            stream = turned_back(turn, self.water(position, time))
            relative = nu.copy()
            relative[:, :3] -= stream
            # nu_r' = nu' + omega x R^T v_c: the stream turns against the body.
            carried = np.zeros_like(nu)
            carried[:, :3] = cross(omega, stream)
            force = force - np.matmul(vehicle.added, carried[..., None])[..., 0]
        else:
            relative = nu
        size = np.abs(relative)
        if vehicle.mixed:
            norm = np.sqrt((relative.reshape(-1, 2, 3) ** 2).sum(-1))
            size = (1 - vehicle.mixed) * size + vehicle.mixed * np.repeat(norm, 3, 1)
        if vehicle.power != 1.0:
            size = size**vehicle.power
        force = force - _coriolis(vehicle.added, relative)
        force = force - np.matmul(relative[:, None, :], self.linear)[:, 0] - self.drag * size * relative
        up = turn[:, 2, :]
        lift = vehicle.buoyancy
        if vehicle.squeeze:
            lift = lift * (1 + vehicle.squeeze * (position[:, 2:] + 2.0))
        weight = vehicle.mass * numbers.GRAVITY
        force[:, :3] += (lift - weight) * up
        force[:, 3:] += cross(lift * vehicle.buoyancy_centre - weight * vehicle.centre, up)
        return np.matmul(self.inverse, force[..., None])[..., 0]

    def step(self, position, quaternion, nu, tau, time, length) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """One Runge-Kutta step of `length` s under a wrench that is held."""

        def rate(p, q, v, t):
            turn = rotation(q)
            spin = np.concatenate([np.zeros((len(v), 1)), v[:, 3:]], 1)
            return turned(turn, v[:, :3]), 0.5 * product(q, spin), self.acceleration(p, turn, v, tau, t)

        half = 0.5 * length
        a = rate(position, quaternion, nu, time)
        b = rate(position + half * a[0], quaternion + half * a[1], nu + half * a[2], time + half)
        c = rate(position + half * b[0], quaternion + half * b[1], nu + half * b[2], time + half)
        d = rate(position + length * c[0], quaternion + length * c[1], nu + length * c[2], time + length)
        out = [
            x + length / 6 * (i + 2 * j + 2 * k + m) for x, i, j, k, m in zip((position, quaternion, nu), a, b, c, d)
        ]
        out[1] /= np.linalg.norm(out[1], axis=1, keepdims=True)
        return tuple(out)

    def readings(self, position, quaternion, nu, tau, time) -> np.ndarray:
        """Noiseless readings [M, 19]: position 3, attitude 4, gyro 3, DVL 3, accelerometer 3, magnetometer 3."""
        turn = rotation(quaternion)
        change = self.acceleration(position, turn, nu, tau, time)
        v, omega, spin = nu[:, :3], nu[:, 3:], change[:, 3:]
        dvl = v + cross(omega, numbers.DVL)
        felt = change[:, :3] + cross(omega, v) + cross(spin, numbers.IMU) + cross(omega, cross(omega, numbers.IMU))
        felt = felt + numbers.GRAVITY * turn[:, 2, :]
        field = turned_back(turn, np.broadcast_to(numbers.FIELD, v.shape))
        return np.concatenate([position, quaternion, omega, dvl, felt, field], 1)


@dataclass(frozen=True)
class Recording:
    """A run of M vehicles: T fine instants, K + 1 rows."""

    times: np.ndarray  # [T] s
    readings: np.ndarray  # [M, T, 19]
    commands: np.ndarray  # [M, K+1, n]
    states: np.ndarray  # [M, K+1, 13] position, quaternion, nu, at rows


def run(
    vehicle: Vehicle, states: np.ndarray, policy, *, rows: int, period: float, hold: float, step: float, start=0.0
) -> Recording:
    """Drive M vehicles from states [M, 13] for `rows` rows of `period` s.

    `policy(row, position, quaternion, nu)` gives the commands [M, n] of a row. They are linear between rows and renewed
    every `hold` s, the nominal's step. `start` [M] s: the time at which each begins. Readings are kept every `step`.
    """
    motion = Motion(vehicle)
    position, quaternion, nu = states[:, :3].copy(), states[:, 3:7].copy(), states[:, 7:].copy()
    start = np.broadcast_to(np.asarray(start, float), (len(states),))
    per_row, per_hold = round(period / step), round(hold / step)
    total = rows * per_row
    first = policy(0, position, quaternion, nu)
    commands = np.empty((len(states), rows + 1, first.shape[1]))
    commands[:, 0] = first
    kept = np.empty((len(states), total + 1, 19))
    at_rows = np.empty((len(states), rows + 1, 13))
    tau = None
    for k in range(total + 1):
        row, part = divmod(k, per_row)
        time = start + k * step
        if part == 0:
            at_rows[:, row] = np.concatenate([position, quaternion, nu], 1)
            if row < rows:
                commands[:, row + 1] = policy(row + 1, position, quaternion, nu)
        if k % per_hold == 0:
            fraction = part / per_row
            last = min(row + 1, rows)
            tau = motion.tau(commands[:, row] * (1 - fraction) + commands[:, last] * fraction)
        kept[:, k] = motion.readings(position, quaternion, nu, tau, time)
        if k < total:
            position, quaternion, nu = motion.step(position, quaternion, nu, tau, time, step)
    return Recording(np.arange(total + 1) * step, kept, commands, at_rows)


def resting(members: int, depth: float | np.ndarray = 2.0, heading: float | np.ndarray = 0.0) -> np.ndarray:
    """States [M, 13] at rest and level."""
    states = np.zeros((members, 13))
    states[:, 2] = -np.asarray(depth)
    turn = np.zeros((members, 3))
    turn[:, 2] = heading
    states[:, 3:7] = exponential(turn)
    return states


def _coriolis(matrix: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """C(nu) nu [M, 6] of a symmetric mass matrix [M, 6, 6] (Kirchhoff; Fossen 2021, theorem 3.2)."""
    momentum = np.matmul(matrix, nu[..., None])[..., 0]
    v, omega = nu[:, :3], nu[:, 3:]
    out = np.empty_like(nu)
    out[:, :3] = cross(omega, momentum[:, :3])
    out[:, 3:] = cross(v, momentum[:, :3]) + cross(omega, momentum[:, 3:])
    return out


def _skew(v: np.ndarray) -> np.ndarray:
    """Matrices [M, 3, 3] of v x, v [M, 3]."""
    out = np.zeros((len(v), 3, 3))
    out[:, 2, 1], out[:, 0, 2], out[:, 1, 0] = v[:, 0], v[:, 1], v[:, 2]
    return out - np.swapaxes(out, 1, 2)

"""Sensors of the same motion, held against each other."""

import itertools
import math

import mujoco
import numpy as np

from .. import frames
from ..model import Model
from ..report import Report
from ..resample import hold, linear, low_pass, slerp
from ..signals import Signal, Signals

#: Rows a second on which motions are compared; seconds of a log that are looked at.
RATE, LONGEST = 10.0, 600.0
#: Samples further apart than this are not compared [s].
MARGIN = 1.0
#: Explained part of a gyro below which a reading of the attitude is doubted, and above which another is believed.
DOUBTED, BELIEVED = 0.5, 0.8
#: Least size of what is compared: rates [rad/s], speeds [m/s], heave thrust as a share of the largest.
LEAST_RATE, LEAST_SPEED, LEAST_THRUST = 0.02, 0.02, 0.02
#: A correlation that contradicts.
CONTRARY = -0.6
#: Rows that a comparison needs.
LEAST_ROWS = 30
DEGREES = 180 / math.pi


def suspect_motion(signals: Signals, model: Model, report: Report) -> None:
    """Say where two signals of one motion disagree, and which reading of them would agree."""
    kinds = {name: model.sensors[name].type for name in signals.sensors}
    of = {kind: signals.sensors[name] for name, kind in kinds.items()}
    attitude, position = of.get("framequat"), of.get("framepos")
    if attitude and "gyro" in of:
        _gyro(attitude, of["gyro"], report)
    if attitude and "magnetometer" in of:
        _compass(attitude, of["magnetometer"], report)
    if position and "framelinvel" in of:
        _velocity(position, of["framelinvel"], None, report)
    elif position and attitude and "velocimeter" in of:
        _velocity(position, of["velocimeter"], attitude, report)
    if position:
        _heave(position, signals, model, report)


def _rows(*signals: Signal) -> np.ndarray:
    start, stop = max(s.times[0] for s in signals), min(s.times[-1] for s in signals)
    return np.arange(start, min(stop, start + LONGEST), 1 / RATE)


def _at(signal: Signal, rows: np.ndarray) -> np.ndarray:
    times, values = signal.within(rows[0] - MARGIN, rows[-1] + MARGIN)
    if signal.is_attitude:
        return slerp(times, values, rows, MARGIN)
    if signal.period < 0.5 / RATE:
        return low_pass(times, values, rows, 1 / RATE)[0]
    return linear(times, values, rows, MARGIN)


def _gyro(attitude: Signal, gyro: Signal, report: Report) -> None:
    rows = _rows(attitude, gyro)
    if rows.size < LEAST_ROWS:
        return
    quaternions, measured = _at(attitude, rows), _at(gyro, 0.5 * (rows[1:] + rows[:-1]))
    turned = _rates(quaternions)
    if (np.isfinite(measured) & np.isfinite(turned)).all(1).sum() < LEAST_ROWS:
        return
    if not max(float(np.sqrt(np.nanmean(rates**2))) for rates in (measured, turned)) > LEAST_RATE:
        return
    # Back into the frames and the order of the log, and read anew.
    given = attitude.source.frame or "ENU/FLU"
    logged = frames.attitude(quaternions, "ENU/FLU", frames.pair(given)) if attitude.source.frame else quaternions
    scores = {}
    for order, inverse, flip, factor in itertools.product(
        (0, 1, -1), (False, True), (False, True), (1, DEGREES, 1 / DEGREES)
    ):
        read = np.roll(logged, order, axis=1)
        read = frames.inverse(read) if inverse else read
        body = frames.pair(given)[1]
        rates = _rates(read) @ frames.rotation(body, "FLU").T if attitude.source.frame else _rates(read)
        rates = rates * [1, -1, -1] if flip else rates
        scores[order, inverse, flip, factor] = _explained(measured / factor, rates)
    own = scores[0, False, False, 1]
    best = max(scores, key=lambda key: (round(scores[key], 2), -sum(map(bool, key[:3])) - (key[3] != 1)))
    if not (own < DOUBTED and scores[best] > BELIEVED):
        return
    said = {
        "the quaternion in the order " + ("xyzw" if attitude.source.order == "wxyz" else "wxyz"): best[0] != 0,
        "the attitude as " + ("world_from_body" if attitude.source.inverse else "body_from_world"): best[1],
        "one of them in FRD and the other in FLU": best[2],
        "the gyro in deg/s": best[3] == DEGREES,
        "the gyro in rad/s": best[3] == 1 / DEGREES,
    }
    changes = " and ".join(text for text, is_so in said.items() if is_so)
    report.suspect(
        f"`{gyro.name}` does not turn as `{attitude.name}` does ({100 * max(own, 0):.0f} % explained); with "
        f"{changes} it does ({100 * scores[best]:.0f} %)"
    )


def _rates(quaternions: np.ndarray) -> np.ndarray:
    """Angular velocities in the body's frame between rows [rad/s]."""
    steps = frames.continuous(frames.product(frames.inverse(quaternions[:-1]), quaternions[1:]))
    steps = steps * np.where(steps[:, :1] < 0, -1.0, 1.0)
    return 2 * RATE * steps[:, 1:]


def _explained(measured: np.ndarray, predicted: np.ndarray) -> float:
    """Part of the measured squares that the prediction explains."""
    both = np.isfinite(measured) & np.isfinite(predicted)
    rest = ((measured - predicted)[both] ** 2).sum()
    return float(1 - rest / max((measured[both] ** 2).sum(), 1e-12))


def _compass(attitude: Signal, magnetometer: Signal, report: Report) -> None:
    rows = _rows(attitude, magnetometer)
    if rows.size < LEAST_ROWS:
        return
    turned, field = frames.matrices(_at(attitude, rows)), _at(magnetometer, rows)
    yaw = np.arctan2(turned[:, 1, 0], turned[:, 0, 0])
    if (np.isfinite(yaw) & np.isfinite(field).all(1)).sum() < LEAST_ROWS:
        return
    if np.nanstd(np.unwrap(yaw[np.isfinite(yaw)])) < 0.3:
        return
    bearing = np.arctan2(field[:, 1], field[:, 0])
    # The field's direction in the world stays where it is.
    spread = {sign: abs(np.nanmean(np.exp(1j * (bearing + sign * yaw)))) for sign in (1, -1)}
    if spread[-1] > 0.9 and spread[1] < 0.7:
        report.suspect(
            f"`{magnetometer.name}` turns the other way than the yaw of `{attitude.name}`: NED taken for ENU (a "
            "compass counts clockwise), or FRD for FLU"
        )


def _velocity(position: Signal, velocity: Signal, attitude: Signal | None, report: Report) -> None:
    rows = _rows(position, velocity, *([attitude] if attitude else []))
    if rows.size < LEAST_ROWS:
        return
    moved = np.gradient(_at(position, rows), 1 / RATE, axis=0)
    measured = _at(velocity, rows)
    if attitude:
        measured = np.einsum("nij,nj->ni", frames.matrices(_at(attitude, rows)), measured)
    for axis, name in enumerate("xyz"):
        if _correlation(moved[:, axis], measured[:, axis]) < CONTRARY:
            report.suspect(
                f"along {name} `{velocity.name}` goes the other way than `{position.name}`: one of them is in NED "
                "or FRD, the other in ENU or FLU"
            )
    across = [_correlation(moved[:, 0], measured[:, 1]), _correlation(moved[:, 1], measured[:, 0])]
    along = [_correlation(moved[:, axis], measured[:, axis]) for axis in (0, 1)]
    if min(across) > 0.8 and max(along) < 0.5:
        report.suspect(
            f"x and y of `{velocity.name}` and `{position.name}` are exchanged: one of them is in NED, the other in ENU"
        )


def _heave(position: Signal, signals: Signals, model: Model, report: Report) -> None:
    """Thrust upwards moves a vehicle up, against the drag of water."""
    gains = _lift(model)
    thrust = [(gains[name], signal) for name, signal in signals.actuators.items() if abs(gains[name]) > 0]
    if not thrust or not np.isfinite(position.range[0][2]):
        return
    rows = _rows(position, *(signal for _, signal in thrust))
    if rows.size < LEAST_ROWS:
        return
    pushes = (gain * hold(*signal.within(rows[0], rows[-1]), rows)[:, 0] for gain, signal in thrust)
    upwards = sum(pushes, np.zeros(rows.size))
    climb = np.gradient(_at(position, rows)[:, 2], 1 / RATE)
    if (np.isfinite(climb) & np.isfinite(upwards)).sum() < LEAST_ROWS:
        return
    if np.nanstd(climb) < LEAST_SPEED or np.nanstd(upwards) < LEAST_THRUST * sum(abs(gain) for gain, _ in thrust):
        return
    found = _correlation(upwards, climb)
    if found < CONTRARY:
        report.suspect(
            f"by `{position.name}` the vehicle sinks when its thrusters push up (correlation {found:.2f}): NED "
            "taken for ENU, a depth for a height, or thrusters of the other sign"
        )


def _lift(model: Model) -> dict[str, float]:
    """Upward acceleration of the first free body by a unit command of each actuator [m/s^2]."""
    compiled = model.compiled
    if not model.free:
        return dict.fromkeys(model.actuators, 0.0)
    dof = next(iter(model.free.values()))[1] + 2
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    still, gains = float(data.qacc[dof]), {}
    for number, name in enumerate(model.actuators):
        data.ctrl[:] = 0
        data.ctrl[number] = 1 if not compiled.actuator_ctrllimited[number] else compiled.actuator_ctrlrange[number, 1]
        mujoco.mj_forward(compiled, data)
        gain = (float(data.qacc[dof]) - still) / (data.ctrl[number] or 1.0)
        gains[name] = gain if abs(gain) > 1e-9 else 0.0
    return gains


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    both = np.isfinite(one) & np.isfinite(other)
    if both.sum() < LEAST_ROWS or not one[both].std() or not other[both].std():
        return 0.0
    if max(one[both].std(), other[both].std()) < LEAST_SPEED:
        return 0.0
    return float(np.corrcoef(one[both], other[both])[0, 1])

"""`mujoco.sysid` with every parameter of the nominal free: masses, inertias, centres, fluid, gains, damping.

Output error over segments of a second from measured starts, residuals divided by each sensor's noise, by the
toolbox's own optimiser. No name comes out of it, hence no false alarm either.
"""

import contextlib
import io
import logging

import mujoco
import numpy as np
from mujoco import sysid

from . import BaselineError
from .motion import Motion

SEGMENT_S = 1.0


def parameters(model: mujoco.MjModel) -> sysid.parameter.ParameterDict:
    """Every free parameter, as a factor or an offset, with wide bounds."""
    out = sysid.parameter.ParameterDict()

    def add(name: str, nominal, low, high, modifier) -> None:
        out.add(sysid.parameter.Parameter(name, nominal, low, high, modifier=modifier))

    for body in range(1, model.nbody):
        name = model.body(body).name
        if model.body_mass[body] < 1e-3 or not name:
            continue

        _inertia(add, model, body, name)
    for geom in range(model.ngeom):
        name = model.geom(geom).name
        if model.geom_fluid[geom, 0] and name:

            def fluid(spec, p, name=name):
                spec.geom(name).fluid_coefs = p.value

            base = model.geom_fluid[geom, 1:6]
            add(f"fluid {name}", base, np.zeros(5), np.maximum(4 * base, 3.0), fluid)
    for actuator in range(model.nu):
        name = model.actuator(actuator).name

        gain0, bias0 = model.actuator_gainprm[actuator].copy(), model.actuator_biasprm[actuator].copy()

        def gain(spec, p, name=name, gain0=gain0, bias0=bias0):
            thing = spec.actuator(name)
            thing.gainprm, thing.biasprm = gain0 * float(p.value[0]), bias0 * float(p.value[0])

        add(f"gain {name}", [1.0], [0.3], [2.0], gain)
    for joint in range(model.njnt):
        name = model.joint(joint).name
        if name:

            def damping(spec, p, name=name):
                spec.joint(name).damping = np.array([float(p.value[0]), 0.0, 0.0])

            base = float(model.dof_damping[model.jnt_dofadr[joint]])
            add(f"damping {name}", [base], [0.0], [max(20 * base, 20.0)], damping)
    return out


def _inertia(add, model: mujoco.MjModel, body: int, name: str) -> None:
    """Mass, centre and all six inertias in the toolbox's ten numbers, which always make a possible body.

    Its ready-made modifier leaves a body without inertia where the MJCF gives a diagonal one (4.0.0): the
    principal inertias are set here instead.
    """
    tools = sysid.model_modifier
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    turn = turn.reshape(3, 3)
    mass, centre = float(model.body_mass[body]), model.body_ipos[body]
    about_centre = turn @ np.diag(model.body_inertia[body]) @ turn.T
    about_origin = about_centre - mass * tools.skew(centre) @ tools.skew(centre)
    pi = np.concatenate([[mass], mass * centre, about_origin.ravel()])
    theta = tools.theta_from_pseudoinertia(tools.pseudoinertia_from_pi(pi))

    def modify(spec, p, name=name):
        pi = tools.pi_from_theta(p.value)
        centre = pi[1:4] / pi[0]
        inertia = pi[4:].reshape(3, 3) + pi[0] * tools.skew(centre) @ tools.skew(centre)
        sizes, axes = np.linalg.eigh(inertia)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, axes.ravel())
        thing = spec.body(name)
        thing.mass, thing.ipos, thing.iquat = pi[0], centre, quaternion
        thing.fullinertia, thing.inertia = [np.nan] * 6, sizes

    # Mass within a factor of two, the axes of the pseudo-inertia within 1.4, 10 cm of the centre.
    room = np.concatenate([[0.35], np.full(3, 0.35), np.full(3, 0.3), np.full(3, 0.1)])
    add(f"inertia {name}", theta, theta - room, theta + room, modify)


def measured(xml: str, model: mujoco.MjModel, motions: list[Motion], segments: int):
    """(sequences of the toolbox, what weighs their residuals). `segments` of the motions' seconds, spread evenly."""
    logging.getLogger("absl").setLevel(logging.ERROR)
    spec = mujoco.MjSpec.from_file(xml)
    rows = round(SEGMENT_S / motions[0].period)
    starts = [(motion, row) for motion in motions for row in range(0, len(motion.time) - rows - 1, rows)]
    starts = [starts[i] for i in np.unique(np.linspace(0, len(starts) - 1, min(segments, len(starts))).astype(int))]
    noise = np.ones(model.nsensordata)
    for i in range(model.nsensor):
        noise[model.sensor_adr[i] : model.sensor_adr[i] + model.sensor_dim[i]] = max(model.sensor_noise[i], 1e-6)
        if model.sensor_type[i] == mujoco.mjtSensor.mjSENS_FRAMEQUAT:
            # A quaternion's components are half a rotation vector's.
            noise[model.sensor_adr[i] : model.sensor_adr[i] + 4] *= 0.5
    measured = sysid.TimeSeries.compute_all_sensor_mapping(model)
    controls = sysid.TimeSeries.compute_all_control_mapping(model)
    names, initial, control, sensors = [], [], [], []
    for motion, row in starts:
        part = slice(row, row + rows + 1)
        time = motion.time[part] - motion.time[row]
        readings = motion.readings[part].copy()
        for column in readings.T:
            bad = ~np.isfinite(column)
            if bad.all():
                column[:] = 0.0
            elif bad.any():
                column[bad] = np.interp(np.flatnonzero(bad), np.flatnonzero(~bad), column[~bad])
        for i in range(model.nsensor):
            if model.sensor_type[i] == mujoco.mjtSensor.mjSENS_FRAMEQUAT:
                at = slice(model.sensor_adr[i], model.sensor_adr[i] + 4)
                attitude = motion.qpos[part, 3:7]
                readings[:, at] *= np.sign(np.sum(readings[:, at] * attitude, 1, keepdims=True))
        state = np.concatenate([[0.0], motion.qpos[row], motion.qvel[row]])
        names.append(f"{motion.name} {row}")
        initial.append(state)
        control.append(sysid.TimeSeries(time, motion.control[part], controls))
        # A row of the toolbox is labelled with the end of the step whose start it shows.
        sensors.append(sysid.TimeSeries(time + model.opt.timestep, readings, measured))
    sequences = [sysid.ModelSequences("nominal", spec, names, initial, control, sensors)]

    def divided(params, predicted, truth, built, return_all, state=None):
        truth = sysid.signal_modifier.apply_delayed_ts_window(truth, predicted, 0.0, 0.0)
        predicted = predicted.resample(truth.times)
        gap = (predicted.data - truth.data) / noise
        # A rollout that blows up must stay comparable.
        # The toolbox compares the two mappings, whose arrays only compare by identity.
        truth = sysid.TimeSeries(truth.times, truth.data, predicted.signal_mapping)
        return np.clip(np.nan_to_num(gap, nan=1e3), -1e3, 1e3), predicted, truth

    return sequences, divided


def fit(xml: str, model: mujoco.MjModel, motions: list[Motion], segments: int, iterations: int) -> mujoco.MjModel:
    """The identified model. `segments` of the motions' seconds are used, spread evenly."""
    sequences, divided = measured(xml, model, motions, segments)
    residual = sysid.build_residual_fn(models_sequences=sequences, modify_residual=divided)
    best = optimum(parameters(model), residual, iterations)
    return sysid.apply_param_modifiers(best, mujoco.MjSpec.from_file(xml))


def optimum(free: sysid.parameter.ParameterDict, residual, iterations: int) -> sysid.parameter.ParameterDict:
    """The parameters at which the residual is least, by the toolbox's own optimiser."""
    try:
        # The toolbox prints its progress whatever `verbose` says; a verdict goes to the same place.
        with contextlib.redirect_stdout(io.StringIO()):
            best, _ = sysid.optimize(free, residual, optimizer="mujoco", verbose=False, max_iters=iterations)
    except ValueError as error:
        # "times must be strictly increasing": a rollout that diverged was reset by the engine, and time with it.
        raise BaselineError(f"mujoco.sysid gave up: {error}") from error
    return best

"""Heave of a box in waves: the plugin beside Capytaine, which solves the linear potential flow with diffraction.

    pip install capytaine && python scripts/compare_capytaine.py

A box of 2 x 1 x 0.5 m and 400 kg, draught 0.2 m, free to heave alone, beam and head seas in deep water. Added mass
and damping of each frequency are Capytaine's; the plugin has them as `added_mass` and `linear_drag` (of the
submerged hull: divided by the part under water, 0.4), the pressure of the undisturbed wave over the hull's panels,
and no diffraction but the added mass and drag in the moving water. Printed: heave over the wave's amplitude.
"""

import json

import mujoco
import numpy as np

from ..benchmarks import LIBRARY

LENGTH, BREADTH, HEIGHT, DRAUGHT = 2.0, 1.0, 0.5, 0.2
RHO, G, MASS = 1000.0, 9.81, 400.0
PERIODS = (1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0)
AMPLITUDE = 0.01


def potential_flow(direction: float) -> dict:
    """Period -> added mass [kg], damping [N s/m], heave over amplitude."""
    import capytaine as cpt  # not among the project's own requirements

    size, centre = (LENGTH, BREADTH, DRAUGHT), (0, 0, -DRAUGHT / 2)
    mesh = cpt.mesh_parallelepiped(size=size, center=centre, resolution=(24, 12, 6), missing_sides={"top"})
    lid = mesh.generate_lid(z=-0.01)
    body = cpt.FloatingBody(mesh=mesh, lid_mesh=lid, dofs=cpt.rigid_body_dofs(rotation_center=(0, 0, 0)))
    solver = cpt.BEMSolver()
    found = {}
    for period in PERIODS:
        omega = 2 * np.pi / period
        same = {"body": body, "omega": omega, "rho": RHO, "g": G, "water_depth": np.inf}
        radiated = solver.solve(cpt.RadiationProblem(radiating_dof="Heave", **same))
        wave = cpt.DiffractionProblem(wave_direction=direction, **same)
        scattered = solver.solve(wave)
        undisturbed = cpt.bem.airy_waves.froude_krylov_force(wave)["Heave"]
        force = undisturbed + scattered.forces["Heave"]
        added, damping = radiated.added_masses["Heave"], radiated.radiation_dampings["Heave"]
        stiffness = RHO * G * LENGTH * BREADTH
        heave = force / (stiffness - omega**2 * (MASS + added) - 1j * omega * damping)
        found[period] = (added, damping, abs(heave))
    return found


def plugin(period: float, direction: float, added: float, damping: float) -> float:
    """Heave over the wave's amplitude in the plugin's water."""
    part = DRAUGHT / HEIGHT
    axes = ("surge", "sway", "heave", "roll", "pitch", "yaw")

    def effect(name, value):
        return {"effect": name, "target": "box", "parameters": dict(zip(axes, [0, 0, value / part, 0, 0, 0]))}

    effects = [{"effect": "hydrostatics", "target": "box", "parameters": {}}]
    effects += [effect("added_mass", added), effect("linear_drag", damping)]
    component = {"amplitude": AMPLITUDE, "period": period, "direction": np.degrees(direction)}
    given = {
        "waterline": "0",
        "effects": json.dumps({"schema": "hydro-effects/1", "effects": effects}),
        "waves": json.dumps({"schema": "hydro-waves/1", "components": [component]}),
    }
    config = "".join(f"<config key=\"{key}\" value='{value}'/>" for key, value in given.items())
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="0.01" integrator="implicitfast"/>
  <extension><plugin plugin="hydro.wrench"><instance name="w">{config}</instance></plugin></extension>
  <worldbody><body name="box" pos="0 0 {HEIGHT / 2 - DRAUGHT}"><joint name="heave" type="slide" axis="0 0 1"/>
    <plugin plugin="hydro.wrench" instance="w"/>
    <geom type="box" size="{LENGTH / 2} {BREADTH / 2} {HEIGHT / 2}" mass="{MASS}"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    omega, settle = 2 * np.pi / period, 12 * 2 * (MASS + added) / damping if damping > 0 else 100
    while data.time < min(max(settle, 20 * period), 120):
        mujoco.mj_step(model, data)
    times, heave = [], []
    for _ in range(round(10 * period / model.opt.timestep)):
        mujoco.mj_step(model, data)
        times.append(data.time)
        heave.append(data.qpos[0])
    columns = np.stack([np.cos(omega * np.array(times)), np.sin(omega * np.array(times)), np.ones(len(times))], 1)
    fit, *_ = np.linalg.lstsq(columns, np.array(heave), rcond=None)
    return float(np.hypot(*fit[:2]) / AMPLITUDE)


def main() -> int:
    """Run the command line; returns the exit status."""
    mujoco.mj_loadPluginLibrary(str(LIBRARY))
    print(
        "| sea | period s | wave length m | added mass kg | damping N s/m | Capytaine | plugin | plugin / Capytaine |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name, direction in (("head", 0.0), ("beam", np.pi / 2)):
        for period, (added, damping, expected) in potential_flow(direction).items():
            found = plugin(period, direction, added, damping)
            length = G * period**2 / (2 * np.pi)
            print(
                f"| {name} | {period} | {length:.1f} | {added:.0f} | {damping:.0f} | {expected:.3f} | {found:.3f} "
                f"| {found / expected:.3f} |"
            )
    return 0

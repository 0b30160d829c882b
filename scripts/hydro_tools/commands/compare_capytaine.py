"""Heave of a box in waves: the plugin beside Capytaine, which solves the linear potential flow with diffraction.

    pip install capytaine && python scripts/compare_capytaine.py

A box of 2 x 1 x 0.5 m and 400 kg, draught 0.2 m, free to heave alone, beam and head seas in deep water, twice in the
plugin:

named effects   added mass and damping of each frequency are Capytaine's, as `added_mass` and `linear_drag` (of the
                submerged hull: divided by the part under water, 0.4); the pressure of the undisturbed wave over the
                hull's panels, no diffraction
potential flow  the attribute `potential_flow`, made once of all frequencies (`hydro_mujoco.from_capytaine`)

Printed: heave over the wave's amplitude.
"""

import json

import mujoco
import numpy as np

import hydro_mujoco

from ..benchmarks import LIBRARY

LENGTH, BREADTH, HEIGHT, DRAUGHT = 2.0, 1.0, 0.5, 0.2
RHO, G, MASS = 1000.0, 9.81, 400.0
PERIODS = (1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0)
AMPLITUDE = 0.01
#: Frequencies of the potential flow [rad/s].
FREQUENCIES = np.arange(0.2, 10.05, 0.2)
SEAS = {"head": 0.0, "beam": np.pi / 2}


def data_set(frequencies: np.ndarray) -> object:
    """Capytaine's results for the box."""
    import capytaine as cpt  # not among the project's own requirements
    import xarray

    size, centre = (LENGTH, BREADTH, DRAUGHT), (0, 0, -DRAUGHT / 2)
    mesh = cpt.mesh_parallelepiped(size=size, center=centre, resolution=(24, 12, 6), missing_sides={"top"})
    lid = mesh.generate_lid(z=-0.01)
    body = cpt.FloatingBody(mesh=mesh, lid_mesh=lid, dofs=cpt.rigid_body_dofs(rotation_center=(0, 0, 0)))
    asked = xarray.Dataset(
        coords={
            "omega": frequencies,
            "wave_direction": list(SEAS.values()),
            "radiating_dof": list(body.dofs),
            "rho": RHO,
            "g": G,
            "water_depth": np.inf,
        }
    )
    return cpt.BEMSolver().fill_dataset(asked, body, hydrostatics=False)


def expected(results: object, direction: float) -> list[tuple[float, float, float, float]]:
    """Period [s], added mass [kg], damping [N s/m] and heave over amplitude, by ascending period."""
    heave = {"radiating_dof": "Heave", "influenced_dof": "Heave"}
    stiffness = RHO * G * LENGTH * BREADTH
    found = []
    for omega in results.omega.values:
        one = results.sel(omega=omega)
        added = float(one.added_mass.sel(heave))
        damping = float(one.radiation_damping.sel(heave))
        wave = one.sel(wave_direction=direction, influenced_dof="Heave")
        force = complex(wave.Froude_Krylov_force) + complex(wave.diffraction_force)
        whole = stiffness - omega**2 * (MASS + added) - 1j * omega * damping
        found.append((2 * np.pi / float(omega), added, damping, abs(force / whole)))
    return found[::-1]


def named_effects(added: float, damping: float) -> dict[str, str]:
    """Attributes of the named effects."""
    part = DRAUGHT / HEIGHT
    axes = ("surge", "sway", "heave", "roll", "pitch", "yaw")

    def effect(name, value):
        return {"effect": name, "target": "box", "parameters": dict(zip(axes, [0, 0, value / part, 0, 0, 0]))}

    return {"effects": _effects(effect("added_mass", added), effect("linear_drag", damping))}


def potential_flow(results: object) -> dict[str, str]:
    """Attributes of the potential flow."""
    point = (0, 0, DRAUGHT - HEIGHT / 2)
    file = hydro_mujoco.from_capytaine(results, volume=LENGTH * BREADTH * DRAUGHT, point=point)
    return {"effects": _effects(), "potential_flow": json.dumps(file)}


def _effects(*others: dict) -> str:
    floats = {"effect": "hydrostatics", "target": "box", "parameters": {}}
    return json.dumps({"schema": "hydro-effects/1", "effects": [floats, *others]})


def heave(attributes: dict[str, str], period: float, direction: float, settle: float) -> float:
    """Heave over the wave's amplitude in the plugin's water, after a time [s]."""
    component = {"amplitude": AMPLITUDE, "period": period, "direction": np.degrees(direction)}
    waves = json.dumps({"schema": "hydro-waves/1", "components": [component]})
    given = {"waterline": "0", "waves": waves, **attributes}
    config = "".join(f"<config key=\"{key}\" value='{value}'/>" for key, value in given.items())
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="0.01" integrator="implicitfast"/>
  <extension><plugin plugin="hydro.wrench"><instance name="w">{config}</instance></plugin></extension>
  <worldbody><body name="box" pos="0 0 {HEIGHT / 2 - DRAUGHT}"><joint name="heave" type="slide" axis="0 0 1"/>
    <plugin plugin="hydro.wrench" instance="w"/>
    <geom type="box" size="{LENGTH / 2} {BREADTH / 2} {HEIGHT / 2}" mass="{MASS}"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    while data.time < min(max(settle, 20 * period), 120):
        mujoco.mj_step(model, data)
    times, heights = [], []
    for _ in range(round(10 * period / model.opt.timestep)):
        mujoco.mj_step(model, data)
        times.append(data.time)
        heights.append(data.qpos[0])
    phase = 2 * np.pi / period * np.array(times)
    columns = np.stack([np.cos(phase), np.sin(phase), np.ones(len(times))], 1)
    fit, *_ = np.linalg.lstsq(columns, np.array(heights), rcond=None)
    return float(np.hypot(*fit[:2]) / AMPLITUDE)


def main() -> int:
    """Run the command line; returns the exit status."""
    mujoco.mj_loadPluginLibrary(str(LIBRARY))
    omegas = 2 * np.pi / np.array(PERIODS)
    results, flow = data_set(omegas), potential_flow(data_set(FREQUENCIES))
    print("| sea | period s | wave length m | Capytaine | named effects | over it | potential flow | over it |")
    print("|---|---|---|---|---|---|---|---|")
    for name, direction in SEAS.items():
        for period, added, damping, right in expected(results, direction):
            settle = 24 * (MASS + added) / damping
            plain = heave(named_effects(added, damping), period, direction, settle)
            whole = heave(flow, period, direction, settle)
            length = G * period**2 / (2 * np.pi)
            print(
                f"| {name} | {period:.2f} | {length:.1f} | {right:.3f} | {plain:.3f} | {plain / right:.3f} "
                f"| {whole:.3f} | {whole / right:.3f} |"
            )
    return 0

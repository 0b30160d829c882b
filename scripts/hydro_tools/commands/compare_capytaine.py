"""Motions of a box in waves: the plugin beside Capytaine, which solves the linear potential flow with diffraction.

    pip install capytaine && python scripts/compare_capytaine.py

A box of 2 x 1 x 0.5 m and 400 kg of even density, draught 0.2 m, in deep water, softly moored (a spring and a damper
along the waves, in both programs: waves of second order would push it away): surge, heave and pitch in head seas, sway,
heave and roll in beam seas; twice in the plugin:

named effects   whole matrices of added mass and damping, at each frequency Capytaine's, as `added_mass` and
                `linear_drag` (of the submerged hull: divided by the part under water, 0.4); the pressure of the
                undisturbed wave over the hull's panels, no diffraction
potential flow  the attribute `potential_flow`, made once of all frequencies (`hydro_mujoco.from_capytaine`)

Printed: amplitudes [m or rad for each m of wave] at the point of the box that lies in the still surface.
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
#: What each sea moves.
MOTIONS = {"head": ("Surge", "Heave", "Pitch"), "beam": ("Sway", "Heave", "Roll")}
DOFS = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")
#: The point that Capytaine's motions are about, in the still surface; body frame [m].
POINT = np.array([0, 0, DRAUGHT - HEIGHT / 2])
#: Of the mooring [N/m, N s/m].
SPRING, DAMPER = 30.0, 60.0
#: Axes of the motions: of a slide, or of a hinge.
AXES = {
    "Surge": ("slide", "1 0 0"),
    "Sway": ("slide", "0 1 0"),
    "Heave": ("slide", "0 0 1"),
    "Roll": ("hinge", "1 0 0"),
    "Pitch": ("hinge", "0 1 0"),
}
#: Step, and when what the start stirred has died away [s].
TIMESTEP, SETTLED = 0.01, 300.0


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


def inertia_and_restoring() -> tuple[np.ndarray, np.ndarray]:
    """Of the floating box about the point in the still surface, 6 x 6."""
    centre = np.array([0, 0, HEIGHT / 2 - DRAUGHT])
    sides = np.array([LENGTH, BREADTH, HEIGHT])
    about_centre = np.diag(MASS / 12 * (np.sum(sides**2) - sides**2))
    arm = np.array([[0, -centre[2], centre[1]], [centre[2], 0, -centre[0]], [-centre[1], centre[0], 0]])
    inertia = np.block([[MASS * np.eye(3), -MASS * arm], [MASS * arm, about_centre - MASS * arm @ arm]])
    restoring = np.zeros((6, 6))
    restoring[2, 2] = RHO * G * LENGTH * BREADTH
    # Second moment of the waterplane, and how far the centre of buoyancy lies above that of mass.
    stands = -DRAUGHT / 2 - centre[2]
    restoring[3, 3] = RHO * G * LENGTH * BREADTH**3 / 12 + MASS * G * stands
    restoring[4, 4] = RHO * G * BREADTH * LENGTH**3 / 12 + MASS * G * stands
    return inertia, restoring


def matrix_of(one: object, name: str) -> np.ndarray:
    """A 6 x 6 matrix of one frequency, rows the forces."""
    return np.asarray(
        one[name].sel(influenced_dof=list(DOFS), radiating_dof=list(DOFS)).transpose("influenced_dof", "radiating_dof")
    )


def expected(results: object, sea: str) -> list[tuple[float, np.ndarray, np.ndarray, dict[str, complex]]]:
    """Period [s], added mass, damping and the motions over the wave's amplitude, by ascending period."""
    inertia, restoring = inertia_and_restoring()
    found = []
    for omega in results.omega.values:
        one = results.sel(omega=omega)
        added, damping = matrix_of(one, "added_mass"), matrix_of(one, "radiation_damping")
        wave = one.sel(wave_direction=SEAS[sea], influenced_dof=list(DOFS))
        force = np.asarray(wave.Froude_Krylov_force) + np.asarray(wave.diffraction_force)
        whole = restoring - omega**2 * (inertia + added) - 1j * omega * damping
        free = [DOFS.index(motion) for motion in MOTIONS[sea]]
        whole[free[0], free[0]] += SPRING - 1j * omega * DAMPER
        moves = np.linalg.solve(whole[np.ix_(free, free)], force[free])
        found.append((2 * np.pi / float(omega), added, damping, dict(zip(MOTIONS[sea], moves))))
    return found[::-1]


def named_effects(added: np.ndarray, damping: np.ndarray) -> dict[str, str]:
    """Attributes of the named effects."""
    part = DRAUGHT / HEIGHT

    def effect(name, matrix):
        matrix = (matrix + matrix.T) / 2
        least = np.linalg.eigvalsh(matrix)[0]
        matrix += max(0, -least) * np.eye(6)  # rounding of the panels
        return {
            "effect": name,
            "target": "box",
            "parameters": {"point": list(POINT), "matrix": (matrix / part).tolist()},
        }

    return {"effects": _effects(effect("added_mass", added), effect("linear_drag", damping))}


def potential_flow(results: object) -> dict[str, str]:
    """Attributes of the potential flow."""
    file = hydro_mujoco.from_capytaine(results, volume=LENGTH * BREADTH * DRAUGHT, point=tuple(POINT))
    return {"effects": _effects(), "potential_flow": json.dumps(file)}


def _effects(*others: dict) -> str:
    floats = {"effect": "hydrostatics", "target": "box", "parameters": {}}
    return json.dumps({"schema": "hydro-effects/1", "effects": [floats, *others]})


def motions(attributes: dict[str, str], period: float, sea: str) -> dict[str, float]:
    """Motions over the wave's amplitude in the plugin's water, once what the start stirred has died away."""
    component = {"amplitude": AMPLITUDE, "period": period, "direction": np.degrees(SEAS[sea])}
    waves = json.dumps({"schema": "hydro-waves/1", "components": [component]})
    given = {"waterline": "0", "waves": waves, **attributes}
    config = "".join(f"<config key=\"{key}\" value='{value}'/>" for key, value in given.items())
    moored = f'stiffness="{SPRING}" damping="{DAMPER}"'
    joints = "".join(
        f'<joint name="{name}" type="{AXES[name][0]}" axis="{AXES[name][1]}" pos="0 0 {POINT[2]}" {extra}/>'
        for name, extra in zip(MOTIONS[sea], (moored, "", ""))
    )
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="{TIMESTEP}" integrator="implicitfast"/>
  <extension><plugin plugin="hydro.wrench"><instance name="w">{config}</instance></plugin></extension>
  <worldbody><body name="box" pos="0 0 {-POINT[2]}">{joints}
    <plugin plugin="hydro.wrench" instance="w"/>
    <geom type="box" size="{LENGTH / 2} {BREADTH / 2} {HEIGHT / 2}" mass="{MASS}"/>
    <body name="box_water"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    while data.time < SETTLED:
        mujoco.mj_step(model, data)
    times, places = [], []
    for _ in range(round(10 * period / TIMESTEP)):
        mujoco.mj_step(model, data)
        times.append(data.time)
        places.append(data.qpos.copy())
    phase = 2 * np.pi / period * np.array(times)
    columns = np.stack([np.cos(phase), np.sin(phase), np.ones(len(times))], 1)
    fit, *_ = np.linalg.lstsq(columns, np.array(places), rcond=None)
    return dict(zip(MOTIONS[sea], np.hypot(*fit[:2]) / AMPLITUDE))


def main() -> int:
    """Run the command line; returns the exit status."""
    mujoco.mj_loadPluginLibrary(str(LIBRARY))
    omegas = 2 * np.pi / np.array(PERIODS)
    results, flow = data_set(omegas), potential_flow(data_set(FREQUENCIES))
    print(
        "| sea | motion | period s | wave length m | Capytaine | named effects | over it | potential flow | over it |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for sea in SEAS:
        for period, added, damping, right in expected(results, sea):
            plain = motions(named_effects(added, damping), period, sea)
            whole = motions(flow, period, sea)
            length = G * period**2 / (2 * np.pi)
            for motion, value in right.items():
                of = abs(value)
                print(
                    f"| {sea} | {motion.lower()} | {period:.2f} | {length:.1f} | {of:.3f} | {plain[motion]:.3f} "
                    f"| {plain[motion] / of:.3f} | {whole[motion]:.3f} | {whole[motion] / of:.3f} |",
                    flush=True,
                )
    return 0

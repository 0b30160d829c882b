"""What keeps a hull upright: draught, metacentric height, righting arms, roll periods, against closed forms and NumPy.

The other side is `polyhedron.py`, which cuts meshes by itself. What was found beside what was expected:
`HYDRO_TEST_TABLE=1 cargo test --test plugin python::stability`.
"""

import json
import math
import os
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
import polyhedron
from scene import steps
from test_afloat import RHO, G, effect, forces, load, period, steps_of

BOAT = Path(__file__).resolve().parents[3] / "examples" / "water" / "boat.xml"
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
#: Lines of what was found.
FOUND: list[str] = []
#: Heel at which a moment is the metacentre's [rad].
SMALL = 1e-4


def tearDownModule():  # noqa: N802
    """Print what was found."""
    if "HYDRO_TEST_TABLE" in os.environ:
        print(*FOUND, sep="\n")


class Case(unittest.TestCase):
    def compare(self, what, found, expected, bound):
        """The difference is below the bound; the line stays for the table."""
        FOUND.append(f"{what}: {found:.8g}, expected {expected:.8g}, off by {found - expected:.1e}")
        self.assertLess(abs(found - expected), bound, what)


def quaternion(roll=0.0, pitch=0.0):
    """Roll about the body's own x after pitch."""
    turn = np.zeros(4)
    mujoco.mju_euler2Quat(turn, [pitch, roll, 0.0], "YXZ")
    return turn


def rotation(roll=0.0, pitch=0.0):
    """World axes of a body after roll and pitch [3, 3]."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion(roll, pitch))
    return matrix.reshape(3, 3)


class Box(Case):
    """2 x 1 x 0.5 m and 400 kg: a draught of 0.2 m, its centre 0.05 m above the surface."""

    WEIGHT, HEIGHT = 400 * G, 0.05
    #: KB = 0.1 m, KG = 0.25 m.
    ACROSS, ALONG = (2 * 1.0**3 / 12) / 0.4, (1 * 2.0**3 / 12) / 0.4

    def test_the_righting_moment_is_that_of_the_metacentre(self):
        model, data = load()
        for k, name, radius in ((3, "roll", self.ACROSS), (4, "pitch", self.ALONG)):
            moment = forces(model, data, self.HEIGHT, **{name: SMALL})[k]
            self.compare(f"GM of {name} [m]", -moment / self.WEIGHT / SMALL, 0.1 + radius - 0.25, 1e-7)

    def test_righting_arms_at_large_angles(self):
        model, data = load()

        def arm(height, angle):
            force = forces(model, data, height, roll=angle)
            self.assertAlmostEqual(force[2], self.WEIGHT, places=6)
            return -force[3] / self.WEIGHT

        # Wall-sided until the bilge comes out, at atan(0.2 / 0.5): about the middle of the waterplane it floats as it is.
        for degrees in (10, 20):
            angle = math.radians(degrees)
            expected = math.sin(angle) * (0.1 + self.ACROSS - 0.25 + 0.5 * self.ACROSS * math.tan(angle) ** 2)
            self.compare(f"GZ at {degrees} degrees [m]", arm(self.HEIGHT * math.cos(angle), angle), expected, 1e-9)
        points = np.array([[x, y, z] for x in (-1, 1) for y in (-0.5, 0.5) for z in (-0.25, 0.25)])
        square = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        faces = np.array([face for a, b, c, d in square for face in ((a, b, c), (a, c, d))])
        for degrees in (40, 60, 80):
            angle = math.radians(degrees)
            turned, height = points @ rotation(angle).T, 0.0
            for _ in range(30):
                part = polyhedron.wet(turned + [0, 0, height], faces)
                height += (part.volume - 0.4) / part.area
            self.compare(f"GZ at {degrees} degrees [m]", arm(height, angle), -part.centre[1], 1e-9)

    def test_what_is_symmetric_is_answered_symmetrically(self):
        model, data = load()
        worst = 0.0
        for roll in np.linspace(0.05, 3.1, 62):
            one, other = (forces(model, data, 0.1, roll=sign * roll) for sign in (1, -1))
            worst = max(worst, np.abs(one * [1, 1, 1, -1, 1, 1] - other * [1, -1, 1, 1, 1, 1]).max())
        self.compare("heeled to port and to starboard [N, N m]", worst, 0.0, 1e-8)


class Ship(Case):
    """A Wigley hull: 4 x 1 m, 0.25 m of draught; its waterplane and its volume are polynomials."""

    LENGTH, BREADTH, DRAUGHT, KG = 4.0, 1.0, 0.25, 0.3
    ADDED = 20.0

    @classmethod
    def setUpClass(cls):
        """The hull as a mesh, and its weight."""
        cls.points, cls.faces = polyhedron.wigley(cls.LENGTH, cls.BREADTH, cls.DRAUGHT, 0.2, stations=61, lines=24)
        cls.wet = polyhedron.wet(cls.points, cls.faces)
        cls.mass = RHO * cls.wet.volume
        cls.inertia = np.array([0.1, 1.1, 1.2]) * cls.mass
        # The frame of the body is at the centre of mass.
        text = " ".join(f"{x:.9g}" for x in (cls.points + [0, 0, cls.DRAUGHT - cls.KG]).ravel())
        corners = " ".join(map(str, cls.faces.ravel()))
        inertia = " ".join(map(str, cls.inertia))
        added = effect("added_mass", **dict.fromkeys(AXES, 0.0) | {"roll": cls.ADDED})
        cls.scene = {
            "effects": [added],
            "asset": f'<mesh name="ship" vertex="{text}" face="{corners}"/>',
            "geoms": '<geom name="hull" type="mesh" mesh="ship" contype="0" conaffinity="0"/>'
            f'<inertial pos="0 0 0" mass="{cls.mass}" diaginertia="{inertia}"/>',
            "timestep": 0.004,
            "integrator": "RK4",
        }

    def metacentre(self):
        """Heights of the metacentres above the centre of mass, of the smooth hull: across and along [m]."""
        rise = 5 / 8 * self.DRAUGHT - self.KG
        across, along = 3 / 35 * self.BREADTH**2 / self.DRAUGHT, 3 / 40 * self.LENGTH**2 / self.DRAUGHT
        return rise + across, rise + along

    def test_the_mesh_is_the_smooth_hull_to_a_thousandth(self):
        length, breadth, draught = self.LENGTH, self.BREADTH, self.DRAUGHT
        self.compare("volume [m^3]", self.wet.volume, 4 / 9 * length * breadth * draught, 2e-3 * self.wet.volume)
        self.compare("waterplane [m^2]", self.wet.area, 2 / 3 * length * breadth, 1e-3 * self.wet.area)
        self.compare("I across [m^4]", self.wet.across, 4 / 105 * length * breadth**3, 2e-3 * self.wet.across)
        self.compare("I along [m^4]", self.wet.along, length**3 * breadth / 30, 1e-3 * self.wet.along)

    def test_metacentric_heights_have_a_closed_form(self):
        model, data = load(**self.scene)
        height = self.KG - self.DRAUGHT
        of_mesh = self.wet.centre[2] - height + np.array([self.wet.across, self.wet.along]) / self.wet.volume
        for k, (name, smooth) in enumerate(zip(("roll", "pitch"), self.metacentre())):
            moment = forces(model, data, height, **{name: SMALL})[3 + k]
            found = -moment / (self.mass * G) / SMALL
            self.compare(f"Wigley hull, GM of {name}, smooth [m]", found, smooth, 1e-3 * smooth)
            self.compare(f"Wigley hull, GM of {name}, of the mesh [m]", found, of_mesh[k], 1e-4 * smooth)

    def test_it_floats_at_its_draught_and_rolls_with_its_period(self):
        model, data = load(**self.scene)
        height = self.KG - self.DRAUGHT
        self.compare(
            "Wigley hull, lift at its draught over its weight", forces(model, data, height)[2] / self.mass / G, 1, 1e-6
        )
        mujoco.mj_resetData(model, data)
        data.qpos[2], data.qpos[3:7] = height, quaternion(roll=0.002)
        track = steps_of(model, data, 3000, lambda: 2 * data.qpos[4])
        part = self.wet.volume / polyhedron.solid(self.points, self.faces)[0]
        inertia = self.inertia[0] + part * self.ADDED
        expected = 2 * math.pi * math.sqrt(inertia / (self.mass * G * self.metacentre()[0]))
        self.compare("Wigley hull, period of roll [s]", period(*track), expected, 1e-3 * expected)


class Upright(NamedTuple):
    """The boat afloat, in axes of the world through its centre of mass."""

    wet: polyhedron.Wet
    #: Corners [n, 3] m.
    points: np.ndarray
    #: Body to world [3, 3].
    attitude: np.ndarray
    #: Of the centre of mass [m].
    height: float

    @property
    def metacentre(self):
        """GM = KB + I/V - KG, across [m]."""
        return self.wet.centre[2] + self.wet.across / self.wet.volume - self.height

    @property
    def draught(self):
        """Depth of the lowest point [m]."""
        return -self.points[:, 2].min()


class Boat(Case):
    """`examples/water/boat.xml` in still water, from the numbers of the file alone."""

    RHO = 1025.0

    @classmethod
    def setUpClass(cls):
        """Corners, weight and effects as the file has them."""

        def numbers(element, name):
            return np.array(element.get(name).split(), float)

        tree = ElementTree.parse(BOAT)
        body, mesh = tree.find(".//body[@name='boat']"), tree.find(".//mesh[@name='hull']")
        cls.points, cls.faces = numbers(mesh, "vertex").reshape(-1, 3), numbers(mesh, "face").astype(int).reshape(-1, 3)
        cls.volume, centre, inertia = polyhedron.solid(cls.points, cls.faces)
        parts = []
        for geom in body.findall("geom"):
            mass = float(geom.get("mass"))
            if geom.get("type") == "mesh":
                parts.append((mass, centre, mass * inertia / cls.volume))
                continue
            squares = numbers(geom, "size") ** 2
            parts.append((mass, numbers(geom, "pos"), mass / 3 * np.diag(squares.sum() - squares)))
        cls.mass = sum(mass for mass, *_ in parts)
        cls.centre = sum(mass * place for mass, place, _ in parts) / cls.mass
        cls.inertia = np.zeros((3, 3))
        for mass, place, own in parts:
            lever = place - cls.centre
            cls.inertia += own + mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
        text = tree.find(".//instance[@name='sea']/config[@key='effects']").get("value")
        cls.effects = {each["effect"]: each["parameters"] for each in json.loads(text)["effects"]}
        cls.afloat = cls.settle()

    @classmethod
    def settle(cls):
        """Where the displaced water weighs as much as the boat, below its centre of mass; by Newton's method."""

        def rest(unknown):
            height, pitch = unknown
            points = (cls.points - cls.centre) @ rotation(pitch=pitch).T + [0, 0, height]
            part = polyhedron.wet(points, cls.faces)
            return part, points, np.array([part.volume - cls.mass / cls.RHO, part.volume * part.centre[0]])

        unknown, small = np.zeros(2), 1e-6
        for _ in range(12):
            slopes = [(rest(unknown + step)[2] - rest(unknown - step)[2]) / (2 * small) for step in small * np.eye(2)]
            unknown -= np.linalg.solve(np.transpose(slopes), rest(unknown)[2])
        part, points, off = rest(unknown)
        assert np.abs(off).max() < 1e-12
        return Upright(part, points, rotation(pitch=unknown[1]), unknown[0])

    def of_roll(self, name):
        """A diagonal effect of the file as a matrix of sway, roll and yaw about the centre of mass; it fades."""
        values = self.afloat.wet.volume / self.volume * np.array([self.effects[name][axis] for axis in AXES])
        turn = np.kron(np.eye(2), self.afloat.attitude)
        x, y, z = self.afloat.attitude @ ((self.points.min(0) + self.points.max(0)) / 2 - self.centre)
        lever = np.eye(6)
        lever[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        return (lever.T @ turn @ np.diag(values) @ turn.T @ lever)[1::2, 1::2]

    def rolling(self):
        """Rolling with sway and yaw: mass, stiffness and drag [3, 3]."""
        mass = np.zeros((3, 3))
        mass[0, 0] = self.mass
        mass[1:, 1:] = (self.afloat.attitude @ self.inertia @ self.afloat.attitude.T)[::2, ::2]
        stiffness = np.diag([0, self.mass * G * self.afloat.metacentre, 0])
        return mass + self.of_roll("added_mass"), stiffness, self.of_roll("linear_drag")

    def still(self, *without):
        """The boat of the file without waves and current, and without these effects."""
        spec = mujoco.MjSpec.from_file(str(BOAT))
        for water in spec.plugins:
            kept = json.loads(water.config["effects"])
            kept["effects"] = [each for each in kept["effects"] if each["effect"] not in without]
            water.config = {**water.config, "waves": "", "current": "", "effects": json.dumps(kept)}
        spec.option.timestep = 0.005
        model = spec.compile()
        return model, mujoco.MjData(model)

    def place(self, model, data, roll):
        """Afloat at rest, heeled by an angle about the centre of mass."""
        mujoco.mj_resetData(model, data)
        attitude = rotation(roll) @ self.afloat.attitude
        mujoco.mju_mat2Quat(data.qpos[3:7], attitude.ravel())
        data.qpos[:3] = [0, 0, self.afloat.height] - attitude @ self.centre

    def test_its_weight_is_that_of_the_file(self):
        model, _ = self.still()
        boat = model.body("boat")
        self.assertAlmostEqual(boat.mass[0], self.mass, places=9)
        np.testing.assert_allclose(boat.ipos, self.centre, atol=1e-6)
        principal = np.sort(np.linalg.eigvalsh(self.inertia))
        np.testing.assert_allclose(np.sort(boat.inertia), principal, rtol=1e-6)

    def test_it_floats_at_the_draught_of_its_weight(self):
        model, data = self.still()
        data.qpos[2] += 0.1
        steps(model, data, 30_000)
        points = self.points @ data.body("boat").xmat.reshape(3, 3).T + data.body("boat").xpos
        self.compare("boat, draught [mm]", -1000 * points[:, 2].min(), 1000 * self.afloat.draught, 0.01)
        trim = np.degrees(
            [np.arcsin(-turn[2, 0]) for turn in (data.body("boat").xmat.reshape(3, 3), self.afloat.attitude)]
        )
        self.compare("boat, trim [degrees]", *trim, 1e-3)

    def test_its_metacentric_height(self):
        model, data = self.still()
        self.place(model, data, SMALL)
        mujoco.mj_forward(model, data)
        # The moment about the centre of mass, in the world.
        boat = data.body("boat")
        force, moment = data.qfrc_passive[:3], boat.xmat.reshape(3, 3) @ data.qfrc_passive[3:6]
        moment = moment - np.cross(boat.xipos - boat.xpos, force)
        self.compare("boat, GM [m]", -moment[0] / (self.mass * G) / SMALL, self.afloat.metacentre, 1e-5)

    def heeled(self, *without):
        """Period of roll after a heel of a quarter of a degree [s]."""
        model, data = self.still(*without)
        self.place(model, data, math.radians(0.25))
        return period(*steps_of(model, data, 4000, lambda: math.atan2(*data.body("boat").xmat[7:9])))

    def test_it_rolls_with_the_period_of_its_metacentre(self):
        mass, stiffness, drag = self.rolling()
        # Sway and yaw follow freely: what resists is the inverse of the mass's inverse.
        expected = 2 * math.pi / math.sqrt(stiffness[1, 1] * np.linalg.inv(mass)[1, 1])
        found = self.heeled("linear_drag", "quadratic_drag")
        self.compare("boat, period of roll without drag [s]", found, expected, 1e-3 * expected)
        speeds = np.linalg.eigvals(
            np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, drag)]])
        )
        expected = 2 * math.pi / np.abs(speeds.imag).max()
        self.compare("boat, period of roll [s]", self.heeled(), expected, 1e-3 * expected)


if __name__ == "__main__":
    unittest.main()

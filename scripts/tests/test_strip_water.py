"""The water of strips against closed forms: a lone bar, its wake, its added mass, a cut ellipsoid, energy, B1."""

import unittest
from dataclasses import replace

import mujoco
import numpy as np

from hydro_mujoco.recording import features
from hydro_tools.datasets import plan, scene
from hydro_tools.strip_water import added_mass, buoyancy, forces, simulation, strips, wake
from hydro_tools.tank import coefficients, drag, geometry

#: A bar of 1 m along x, a square section of 0.1 m, and what its strips are told to be: a cylinder of that diameter.
LENGTH, DIAMETER, COUNT = 1.0, 0.1, 10
CROSS, ALONG = 1.2, 0.8
DENSITY = 1000.0


def cylinder(model, waterline=None):
    """Water of `model`, whose body `bar` is a cylinder along x with textbook coefficients."""
    y, z = np.eye(3)[1:]
    half = 0.5 * LENGTH * np.eye(3)[0]
    made = strips.strips({"bar": [geometry.Link("bar", "thigh", -half, half, y, z, (DIAMETER, DIAMETER), COUNT)]})
    part = LENGTH / COUNT
    round_ = np.pi * DIAMETER**2 / 4
    numbers = {
        "areas": np.tile([CROSS * DIAMETER * part, CROSS * DIAMETER * part, ALONG * round_ / COUNT], (COUNT, 1)),
        "wetted": np.zeros(COUNT),
    }
    for name, value in numbers.items():
        object.__setattr__(made.sections, name, value)
    return forces.water(model, made, waterline)


def volumes(bar):
    """Potential flow about a long cylinder: the displaced volume across, nothing along."""
    part = np.pi * DIAMETER**2 / 4 * LENGTH / COUNT
    return np.tile([part, part, 0.0], (len(bar.owner), 1))


def wake_energy(bars, wakes, density):
    """Energy [m] J of wakes [m,S,3] m/s in water of density [m] kg/m^3, with coefficients as of a slow flow."""
    area, _ = bars.sections.resistance(np.full_like(wakes, 1e-3))
    mass = 0.5 * wake.GAIN * area * wake.LENGTH * bars.width[:, None] / wake.SHARE
    return 0.5 * density * np.sum(mass * wakes**2, axis=(1, 2))


def floating(mass=7.0, extra=""):
    """A free bar that weighs `mass` [kg]; its hull is an ellipsoid."""
    inertia = (mass * DIAMETER**2 / 6, mass * LENGTH**2 / 12, mass * LENGTH**2 / 12)
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco><option timestep="0.002" integrator="Euler" {extra}/><worldbody><body name="bar"><freejoint/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia[0]} {inertia[1]} {inertia[2]}"/>
      <geom type="ellipsoid" size="0.5 0.05 0.04" pos="0.05 0 0.01" contype="0" conaffinity="0" fluidshape="ellipsoid"/>
    </body></worldbody></mujoco>""")


class Lone(unittest.TestCase):
    """A lone cylinder, with added volumes of potential flow."""

    def setUp(self):
        original = added_mass.added_volumes
        self.addCleanup(setattr, added_mass, "added_volumes", original)
        added_mass.added_volumes = volumes

    def at_rest(self, velocity, mass=7.0, **options):
        """One simulation, evaluated, of a bar that moves at `velocity` [6] through water at rest."""
        model = floating(mass, 'gravity="0 0 0"')
        run = simulation.Simulation(simulation.dry(model), cylinder(model, **options), 1)
        run.datas[0].qvel[:] = velocity
        return run

    def test_drag_of_a_start_and_of_steady_motion(self):
        for axis, speed in ((1, 0.3), (2, 0.8), (0, 0.5)):
            velocity = np.zeros(6)
            velocity[axis] = speed
            run = self.at_rest(velocity)
            # By hand: 1/2 rho C D L u^2; round bars lose a little at higher Reynolds numbers.
            fall = float(coefficients.edge(np.array((1 - wake.SHARE) * speed * DIAMETER / drag.VISCOSITY)))
            by_hand = 0.5 * DENSITY * CROSS * DIAMETER * LENGTH * speed**2
            if axis == 0:
                fall, by_hand = 1.0, 0.5 * DENSITY * ALONG * np.pi * DIAMETER**2 / 4 * speed**2
            run.settle([0])
            steady = run.evaluate([0]).drag[0]
            self.assertAlmostEqual(-steady[axis] / (fall * by_hand), 1.0, places=9)
            np.testing.assert_allclose(np.delete(steady, axis), 0, atol=1e-9)
            run.wakes[:] = 0.0
            start = run.evaluate([0]).drag[0]
            first = 1.0 if axis == 0 else float(coefficients.edge(np.array(speed * DIAMETER / drag.VISCOSITY)))
            self.assertAlmostEqual(start[axis] / steady[axis], first / fall / (1 - wake.SHARE) ** 2, places=9)

    def test_wake_follows_a_step_at_a_width_over_a_speed(self):
        bar = cylinder(floating()).strips
        speed, step = 0.4, 1e-4
        velocity = np.tile([speed, 0.0, 0.0], (1, COUNT, 1))
        wakes, gone = np.zeros_like(velocity), 0.0
        for _ in range(5000):
            _, pace = bar.sections.resistance(velocity - wakes)
            wakes = wake.follow(bar, wakes, velocity, pace, step)
            gone += step
        # dw/dt = (s u - w)(u - w) / l in closed form: (u - w) / (s u - w) = e^(u (1 - s) t / l) / s.
        ratio = np.exp(speed * (1 - wake.SHARE) * gone / (wake.LENGTH * DIAMETER)) / wake.SHARE
        wanted = speed * (ratio * wake.SHARE - 1) / (ratio - 1)
        np.testing.assert_allclose(wakes[0, :, 0], wanted, rtol=1e-3)
        np.testing.assert_array_equal(wakes[..., 1:], 0)
        self.assertLess(wanted, wake.SHARE * speed)

    def test_added_mass_by_a_finite_acceleration(self):
        """A push on a bar at rest: the mass that resists is the body's and the displaced water's."""
        model = floating(extra='gravity="0 0 0"')
        displaced = DENSITY * np.pi * DIAMETER**2 / 4 * LENGTH
        for axis, mass in ((0, 7.0), (1, 7.0 + displaced), (2, 7.0 + displaced)):
            run = simulation.Simulation(simulation.dry(model), cylinder(model), 1)
            run.datas[0].xfrc_applied[1, axis] = 3.0
            run.step([0])
            self.assertAlmostEqual(3.0 / (run.datas[0].qvel[axis] / model.opt.timestep), mass, places=6)
        run = simulation.Simulation(simulation.dry(model), cylinder(model), 1)
        run.datas[0].xfrc_applied[1, 5] = 3.0
        run.step([0])
        turning = 7.0 / 12 + sum(
            displaced / COUNT * x**2 for x in (np.arange(COUNT) + 0.5) * LENGTH / COUNT - 0.5 * LENGTH
        )
        self.assertAlmostEqual(3.0 / (run.datas[0].qvel[5] / model.opt.timestep), turning, places=6)

    def test_munk_moment_turns_a_bar_broadside(self):
        run = self.at_rest([0.5, 0.3, 0, 0, 0, 0])
        run.settle([0])
        torque = run.evaluate([0]).drift[0, 5]
        displaced = DENSITY * np.pi * DIAMETER**2 / 4 * LENGTH
        # (m_x - m_y) u v with m_x = 0 is minus that of the body on the water: it turns the bar broadside.
        self.assertAlmostEqual(torque, -(0.0 - displaced) * 0.5 * 0.3 * -1, places=9)

    def test_a_falling_bar_follows_the_analytic_solution(self):
        """Dropped across: (m + m_a) dv/dt = W - B - 1/2 rho C' A (v - w)^2, dw/dt = (s v - w)(v - w) / l; RK4 by hand."""
        model = floating(mass=14.0)
        water = cylinder(model)
        run = simulation.Simulation(simulation.dry(model), water, 1)
        run.datas[0].qpos[3:7] = [1, 0, 0, 0]
        ellipsoid = 4 / 3 * np.pi * 0.5 * 0.05 * 0.04
        weight = 9.81 * (14.0 - DENSITY * ellipsoid)
        # The hull's centre is not the bar's: hold the attitude, so that it falls flat.
        mass = 14.0 + DENSITY * np.pi * DIAMETER**2 / 4 * LENGTH

        def rate(state):
            v, w = state
            fall = float(coefficients.edge(np.array(abs(v - w) * DIAMETER / drag.VISCOSITY)))
            pull = 0.5 * DENSITY * CROSS * DIAMETER * LENGTH * fall * (v - w) * abs(v - w) / (1 - wake.SHARE) ** 2
            lag = (wake.SHARE * v - w) * abs(v - w) / (wake.LENGTH * DIAMETER)
            return np.array([(weight - pull) / mass, lag])

        state, step = np.zeros(2), model.opt.timestep
        for _ in range(1000):
            run.step([0])
            run.datas[0].qpos[3:7], run.datas[0].qvel[3:] = [1, 0, 0, 0], 0.0
            k1 = rate(state)
            k2 = rate(state + 0.5 * step * k1)
            k3 = rate(state + 0.5 * step * k2)
            state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + rate(state + step * k3))
        found = -run.datas[0].qvel[2]
        # The hull's torque accelerates the held attitude, and no force: the two differ by the integrator alone.
        self.assertGreater(state[0], 0.3)
        self.assertAlmostEqual(found / state[0], 1.0, delta=2e-3)
        np.testing.assert_allclose(-run.wakes[0, :, 1], state[1], rtol=2e-3)


class Hulls(unittest.TestCase):
    def test_a_cut_ellipsoid_against_counting(self):
        model = floating()
        hulls = buoyancy.of_model(model, np.array([1]))
        rng = np.random.default_rng(3)
        points = rng.uniform(-1, 1, (400_000, 3))
        points = points[np.sum(points**2, axis=1) < 1] * hulls.semi_axes[0]
        for height in (-0.06, -0.02, 0.0, 0.01, 0.5):
            up = rng.normal(size=3)
            up /= np.linalg.norm(up)
            share, centre = buoyancy.cut(hulls, up[None, None], np.array([[height]]))
            below = points[points @ up < height]
            self.assertAlmostEqual(share[0, 0], len(below) / len(points), delta=3e-3)
            if len(below) > 1000:
                np.testing.assert_allclose(centre[0, 0], below.mean(axis=0), atol=6e-3)

    def test_deep_buoyancy_is_the_weight_of_the_water(self):
        model = floating()
        hulls = buoyancy.of_model(model, np.array([1]))
        up = np.array([[[0.0, 0.6, 0.8]]])
        found = buoyancy.wrench(hulls, np.array([9810.0]), up, None, 1)[0, 0]
        force = 9810.0 * 4 / 3 * np.pi * 0.5 * 0.05 * 0.04 * up[0, 0]
        np.testing.assert_allclose(found, np.concatenate((np.cross([0.05, 0, 0.01], force), force)), rtol=1e-12)
        far = buoyancy.wrench(hulls, np.array([9810.0]), up, np.array([[5.0]]), 1)[0, 0]
        np.testing.assert_allclose(far, found, rtol=1e-12)
        out = buoyancy.wrench(hulls, np.array([9810.0]), up, np.array([[-5.0]]), 1)[0, 0]
        np.testing.assert_allclose(out, 0, atol=1e-12)


class Robot(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = scene.load()
        cls.water = forces.water(cls.scene.model, strips.b1())

    def simulation(self, count=1, timestep=None, water=None):
        model = simulation.dry(self.scene.model)
        model.opt.timestep = timestep or model.opt.timestep
        return simulation.Simulation(model, water or self.water, count)

    def thrown(self, run, rng):
        model = run.model
        for data in run.datas:
            data.qpos[3:7] = rng.normal(size=4)
            data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
            data.qpos[7:] = 0.5 * model.jnt_range[1:].sum(axis=1)
            data.qvel[:] = rng.normal(0, 1.0, model.nv)

    def test_strips_ride_on_their_links(self):
        made = self.water.strips
        self.assertEqual(made.names[:5], ("trunk", "FR_hip", "FR_thigh", "FR_calf", "FL_hip"))
        self.assertEqual(len(made.owner), 8 + 4 * (1 + 4 + 4 + 1))
        body = made.sections.body
        calf = np.flatnonzero(made.owner == 3)
        np.testing.assert_allclose(body.centre[calf[-1]], [0, 0, -0.35], atol=1e-12)
        np.testing.assert_allclose(body.centre[calf[:-1], 2], -0.35 * (np.arange(4) + 0.5) / 4, atol=1e-12)
        self.assertEqual(len(self.water.hulls.volume), 17)
        self.assertAlmostEqual(self.water.hulls.volume.sum(), 0.058, places=6)

    def test_kinematics_are_those_of_mujoco(self):
        rng = np.random.default_rng(0)
        run = self.simulation(3)
        self.thrown(run, rng)
        run.evaluate([0, 1, 2])
        at = run.reader.read([0, 1, 2])
        model = run.model
        for i, data in enumerate(run.datas):
            for row, body in enumerate(run.reader.bodies):
                turn = data.xmat[body].reshape(3, 3)
                linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
                mujoco.mj_jacBody(model, data, linear, angular, body)
                wanted = np.concatenate((turn.T @ angular, turn.T @ linear))
                np.testing.assert_allclose(at.jacobian[i, row], wanted, atol=1e-12)
                velocity = np.zeros(6)
                mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 1)
                np.testing.assert_allclose(at.velocity[i, row], velocity, atol=1e-12)

    def test_drift_is_the_rate_of_the_velocity_at_no_acceleration(self):
        run = self.simulation(1)
        self.thrown(run, np.random.default_rng(1))
        data, model = run.datas[0], run.model
        start, speed, h = data.qpos.copy(), data.qvel.copy(), 1e-6
        found = []
        for sign in (-1, 1):
            data.qpos[:] = start
            mujoco.mj_integratePos(model, data.qpos, speed, sign * h)
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fwdVelocity(model, data)
            found.append(run.reader.read([0]).velocity)
        data.qpos[:] = start
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        at = run.reader.read([0])
        np.testing.assert_allclose(at.drift, (found[1] - found[0]) / (2 * h), atol=1e-6)

    def test_the_force_that_is_told_is_the_one_that_acts(self):
        """qacc of MuJoCo without water, pushed by what is told, is the one that the water led to."""
        run = self.simulation(2)
        self.thrown(run, np.random.default_rng(2))
        told = run.evaluate([0, 1])
        qacc = run.accelerations([0, 1])
        force = told.drag + told.lift + told.added(qacc)
        model = simulation.dry(self.scene.model)
        for i, data in enumerate(run.datas):
            plain = mujoco.MjData(model)
            plain.qpos[:], plain.qvel[:] = data.qpos, data.qvel
            plain.qfrc_applied[:] = force[i]
            mujoco.mj_forward(model, plain)
            np.testing.assert_allclose(plain.qacc, qacc[i], rtol=1e-6, atol=1e-6)

    def energy(self, run):
        """Of robot, added mass and wakes [J]."""
        out = []
        at = run.reader.read(range(len(run.datas)))
        added = DENSITY * added_mass.joint_space(added_mass.matrices(self.water.strips), at.jacobian)
        wakes = wake_energy(self.water.strips, run.wakes, run.density)
        for i, data in enumerate(run.datas):
            inertia = np.zeros((run.model.nv, run.model.nv))
            mujoco.mj_fullM(run.model, data, inertia)
            # Evaluated, MuJoCo's matrix holds the added mass already.
            out.append(0.5 * data.qvel @ inertia @ data.qvel + wakes[i])
            self.assertGreater(np.linalg.eigvalsh(inertia - added[i]).min(), 0)
        return np.array(out)

    def still(self, timestep):
        """No gravity, no servos, no limits in water at rest."""
        run = self.simulation(6, timestep=timestep, water=replace(self.water, gravity=0.0))
        run.model.opt.gravity[:] = 0.0
        flags = mujoco.mjtDisableBit
        run.model.opt.disableflags |= flags.mjDSBL_ACTUATION | flags.mjDSBL_CONSTRAINT
        self.thrown(run, np.random.default_rng(7))
        run.settle(range(6))
        return run

    def test_still_water_makes_no_energy(self):
        run = self.still(0.0005)
        energies = []
        for _ in range(2000):
            told = run.evaluate(range(6))
            energies.append(self.energy(run))
            run.advance(range(6), told)
        energies = np.array(energies)
        self.assertLess((np.diff(energies, axis=0) / energies[0]).max(), 1e-5)
        self.assertLess((energies[-1] / energies[0]).max(), 0.3)
        self.assertGreater(energies[-1].min(), 0.0)

    def test_added_mass_alone_keeps_energy(self):
        """Without drag what is left of the error falls with the step: it is the integrator's."""
        original = wake.GAIN
        self.addCleanup(setattr, wake, "GAIN", original)
        wake.GAIN = 0.0
        lost = []
        for timestep in (0.0004, 0.0001):
            run = self.still(timestep)
            told = run.evaluate(range(6))
            before = self.energy(run)
            for _ in range(round(0.04 / timestep)):
                run.advance(range(6), told)
                told = run.evaluate(range(6))
            lost.append(np.abs(self.energy(run) / before - 1).max())
        self.assertLess(lost[1], 0.4 * lost[0])
        self.assertLess(lost[1], 0.02)

    def test_a_surface_far_above_changes_nothing_and_one_far_below_leaves_air(self):
        told = []
        for waterline in (None, 50.0, -50.0):
            run = self.simulation(2, water=replace(self.water, waterline=waterline))
            self.thrown(run, np.random.default_rng(4))
            told.append(run.evaluate([0, 1]))
        for name in ("drag", "lift", "mass", "drift"):
            deep, far, air = (getattr(each, name) for each in told)
            np.testing.assert_allclose(far, deep, rtol=1e-9, atol=1e-9)
            np.testing.assert_array_equal(air, 0)

    def test_neighbours_change_no_bit(self):
        plans = [plan.task2(11, plan.Stream.TEST, i, samples=12, joint_range=self.scene.joint_range) for i in (0, 1, 5)]
        plans = [
            replace(each, warm_up=0, **{n: getattr(each, n)[each.warm_up :] for n in ("ctrl", "push", "density")})
            for each in plans
        ]
        settings = {"base": 1, "layout": self.scene.layout, "substeps": 5}
        together = simulation.simulate(self.scene.model, self.water, plans, **settings)
        alone = simulation.simulate(self.scene.model, self.water, plans[1:2], **settings)
        np.testing.assert_array_equal(alone.wrench[0], together.wrench[1])
        np.testing.assert_array_equal(alone.extra["generalised"][0], together.extra["generalised"][1])
        self.assertEqual(together.extra["generalised"].shape, (3, 12, 18))
        whole = features.base_wrench(together.qpos[..., 3:7], together.extra["generalised"][..., :6])
        np.testing.assert_array_equal(whole, together.wrench)


if __name__ == "__main__":
    unittest.main()

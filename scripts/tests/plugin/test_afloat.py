"""Hydrostatics, surface, waves and currents in a plain MJCF, against closed forms, in the MuJoCo wheel."""

import json
import math
import re
import unittest

import mujoco
import mujoco.rollout
import numpy as np
from mujoco.batch import Batch
from scene import Warnings, steps

RHO, G = 1000.0, 9.81
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
BOX = '<geom name="hull" type="box" size="1 0.5 0.25" mass="400"/>'


def effect(name, target="hull", **parameters):
    """One entry of an effects.json."""
    return {"effect": name, "target": target, "parameters": parameters}


def on_axes(name, values):
    """An entry with one value an axis."""
    return effect(name, **dict(zip(AXES, values)))


def waves(**component):
    """The attribute `waves` of one component."""
    return json.dumps({"schema": "hydro-waves/1", "components": [component]})


def scene_xml(effects=(), geoms=BOX, asset="", timestep=0.005, integrator="implicitfast", **attributes):
    """A free body with these geoms and attributes, hydrostatics on it."""
    listed = [effect("hydrostatics"), *(effects or ())]
    text = attributes.pop("effects_text", json.dumps({"schema": "hydro-effects/1", "effects": listed}))
    given = {"effects": text, "waterline": "0", **attributes}
    quoted = {key: value.replace("&", "&amp;").replace('"', "&quot;") for key, value in given.items() if value}
    config = "".join(f'<config key="{key}" value="{value}"/>' for key, value in quoted.items())
    return f"""
<mujoco>
  <option timestep="{timestep}" gravity="0 0 {-G}" integrator="{integrator}"/>
  <extension><plugin plugin="hydro.wrench"><instance name="water">{config}</instance></plugin></extension>
  <asset>
    <mesh name="box" vertex="-1 -.5 -.25 1 -.5 -.25 1 .5 -.25 -1 .5 -.25 -1 -.5 .25 1 -.5 .25 1 .5 .25 -1 .5 .25"/>
    {asset}
  </asset>
  <worldbody>
    <body name="hull"><freejoint/><plugin plugin="hydro.wrench" instance="water"/>{geoms}<body name="hull_water"/></body>
  </worldbody>
  <sensor><plugin name="water" plugin="hydro.wrench" instance="water"/></sensor>
</mujoco>"""


def load(*args, **kwargs):
    """The compiled scene and a data of it."""
    model = mujoco.MjModel.from_xml_string(scene_xml(*args, **kwargs))
    return model, mujoco.MjData(model)


def forces(model, data, height, roll=0.0, pitch=0.0, velocity=(0,) * 6):
    """The generalised passive forces of the free body at a height and attitude."""
    mujoco.mj_resetData(model, data)
    data.qpos[2] = height
    turn = np.zeros(4)
    mujoco.mju_euler2Quat(turn, [roll, pitch, 0.0], "XYZ")
    data.qpos[3:7] = turn
    data.qvel[:6] = velocity
    mujoco.mj_forward(model, data)
    return data.qfrc_passive[:6].copy()


def period(times, values):
    """Mean period between upward crossings of the mean."""
    values = np.asarray(values) - np.mean(values)
    up = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    part = -values[up] / (values[up + 1] - values[up])
    crossings = np.asarray(times)[up] + part * (times[1] - times[0])
    return float(np.diff(crossings).mean())


class Hydrostatics(unittest.TestCase):
    def test_a_box_settles_at_its_draught(self):
        model, data = load([on_axes("linear_drag", [400.0, 400, 4000, 300, 300, 300])])
        data.qpos[2] = 0.3
        steps(model, data, 8000)
        # 400 kg on 2 m^2: 0.2 m of draught; the centre of the box is 0.05 m above the surface.
        self.assertAlmostEqual(data.qpos[2], 0.25 - 400 / (RHO * 2.0), places=6)

    def test_a_sphere_through_the_surface_is_its_cap(self):
        model, data = load(geoms='<geom type="sphere" size="0.3" mass="20"/>')
        for height in np.linspace(-0.4, 0.4, 33):
            depth = min(max(0.3 - height, 0.0), 0.6)
            cap = math.pi * depth**2 * (3 * 0.3 - depth) / 3
            self.assertAlmostEqual(forces(model, data, height)[2], RHO * G * cap, places=8)

    def test_a_mesh_is_the_box_that_it_is(self):
        mesh = '<geom name="hull" type="mesh" mesh="box" mass="400"/>'
        (one, of_one), (other, of_other) = load(), load(geoms=mesh)
        random = np.random.default_rng(1)
        for _ in range(50):
            pose = random.uniform([-0.5, -1.5, -1.5], [0.5, 1.5, 1.5])
            np.testing.assert_allclose(forces(one, of_one, *pose), forces(other, of_other, *pose), atol=1e-9)

    def test_volume_and_centre_override_the_geoms(self):
        model, data = load(volume="0.35", centre_of_buoyancy="0.1 0 0.2")
        deep = forces(model, data, -3.0)
        np.testing.assert_allclose(deep, [0, 0, 0.35 * RHO * G, 0, -0.1 * 0.35 * RHO * G, 0], atol=1e-8)
        half = forces(model, data, 0.0)
        np.testing.assert_allclose(half, 0.5 * deep, atol=1e-8)

    def test_without_a_waterline_everything_is_submerged(self):
        model, data = load(waterline="")
        self.assertAlmostEqual(forces(model, data, 30.0)[2], RHO * G, places=8)


class Motion(unittest.TestCase):
    def test_periods_of_heave_and_roll(self):
        # Of the submerged box; at its draught two fifths are under water, and of the added mass as much.
        added, part = [0, 0, 1500.0, 150.0, 0, 0], 0.4
        model, data = load([on_axes("added_mass", added)], timestep=0.002, integrator="RK4")
        data.qpos[2] = 0.05 + 0.005
        track = steps_of(model, data, 5000, lambda: data.qpos[2])
        expected = 2 * math.pi * math.sqrt((400 + 1500 * part) / (RHO * G * 2.0))
        self.assertAlmostEqual(period(*track) / expected, 1.0, delta=2e-3)
        mujoco.mj_resetData(model, data)
        data.qpos[2], data.qpos[4] = 0.05, 0.5 * 0.005
        track = steps_of(model, data, 8000, lambda: 2 * data.qpos[4])
        inertia = 400 * (1.0**2 + 0.5**2) / 12 + 150.0 * part
        metacentre = 0.1 + (2 / 12) / 0.4 - 0.25
        expected = 2 * math.pi * math.sqrt(inertia / (400 * G * metacentre))
        self.assertAlmostEqual(period(*track) / expected, 1.0, delta=2e-3)

    def test_a_body_afloat_keeps_its_energy(self):
        model, data = load(timestep=0.002, integrator="RK4")
        data.qpos[2] = 0.10

        def energy():
            draught = min(max(0.25 - data.qpos[2], 0.0), 0.5)
            return 200 * data.qvel[2] ** 2 + 400 * G * data.qpos[2] + RHO * G * draught**2

        start, oscillation = energy(), RHO * G * 0.05**2
        found = np.array(steps_of(model, data, 100_000, energy)[1])
        self.assertLess(np.abs(found - start).max(), 1e-7 * oscillation)

    def test_a_small_body_follows_the_wave(self):
        sphere = '<geom type="sphere" size="0.05" density="500"/>'
        sea = waves(height=0.2, period=5.0)
        model, data = load([on_axes("linear_drag", [2.0, 2, 2, 0.01, 0.01, 0.01])], geoms=sphere, waves=sea)
        omega = 2 * math.pi / 5.0
        steps(model, data, 4000)
        found = np.array(
            steps_of(model, data, 8000, lambda: (data.qpos[2], wave(0.2, omega, data.qpos[0], data.time)))[1]
        )
        heave, surface = found[:, 0] - found[:, 0].mean(), found[:, 1]
        self.assertAlmostEqual(np.std(heave) / np.std(surface), 1.0, delta=5e-4)
        self.assertGreater(np.corrcoef(heave, surface)[0, 1], 0.999)

    def test_a_body_deep_below_a_wave_is_at_rest(self):
        sphere = '<geom type="sphere" size="0.1" density="1000"/>'
        model, data = load(geoms=sphere, waves=waves(height=0.4, period=3.0))
        deep = forces(model, data, -14.05)  # one wave length
        weight = 4 / 3 * math.pi * 0.1**3 * RHO
        swing = weight * 0.2 * (2 * math.pi / 3) ** 2
        self.assertLess(abs(deep[2] - weight * G), 3e-3 * swing)

    def test_the_mean_force_of_a_wave_is_none(self):
        sphere = '<geom type="sphere" size="0.1" density="1000"/>'
        model, data = load(geoms=sphere, waves=waves(height=0.1, period=3.0))
        found = []
        for k in range(60):
            mujoco.mj_resetData(model, data)
            data.time, data.qpos[2] = 3.0 * k / 60, -0.5
            mujoco.mj_forward(model, data)
            found.append(data.qfrc_passive[:3].copy())
        found = np.array(found) - [0, 0, 4 / 3 * math.pi * 0.1**3 * RHO * G]
        self.assertGreater(np.abs(found).max(), 0.1)
        self.assertLess(np.abs(found.mean(0)).max(), 1e-9)

    def test_a_current_takes_what_floats_along(self):
        drag = on_axes("linear_drag", [100.0, 100, 1000, 100, 100, 100])
        model, data = load([drag], current="0.3 -0.1 0")
        data.qpos[2] = 0.05
        steps(model, data, 20000)
        # Half a hull above the surface: the drag fades, the drift does not.
        np.testing.assert_allclose(data.qvel[:2], [0.3, -0.1], atol=1e-4)

    def test_a_profile_slows_with_depth(self):
        profile = json.dumps(
            {
                "schema": "hydro-current/1",
                "profile": [{"depth": 0, "velocity": [1, 0, 0]}, {"depth": 10, "velocity": [0, 0, 0]}],
            }
        )
        drag = on_axes("linear_drag", [100.0, 100, 100, 1, 1, 1])
        model, data = load([drag], current=profile)
        for depth, speed in ((2.5, 0.75), (5.0, 0.5), (20.0, 0.0)):
            self.assertAlmostEqual(forces(model, data, -depth)[0], 100 * speed, places=9)


def wave(height, omega, x, time):
    """Elevation of a wave in deep water that travels along x [m]."""
    return 0.5 * height * math.cos(omega**2 / G * x - omega * time)


def steps_of(model, data, count, value):
    """Times, and a value after each of `count` steps."""
    times, values = [], []
    for _ in range(count):
        mujoco.mj_step(model, data)
        times.append(data.time)
        values.append(value())
    return times, values


class Fading(unittest.TestCase):
    def test_drag_and_added_mass_fade_with_the_submerged_part(self):
        drag, added = on_axes("linear_drag", [100.0] * 6), on_axes("added_mass", [200.0] * 6)
        model, data = load([drag, added])
        still = {height: forces(model, data, height) for height in (-1.0, 0.0, 0.125, 47.0)}
        for height, part in ((-1.0, 1.0), (0.0, 0.5), (0.125, 0.25), (47.0, 0.0)):
            moved = forces(model, data, height, velocity=(0.5, 0, 0, 0, 0, 0))
            self.assertAlmostEqual(moved[0] - still[height][0], -50.0 * part, places=9)
            self.assertAlmostEqual(data.M[model.M_rowadr[0]], 400 + 200 * part + (0.005 * 100 * part), places=6)

    def test_without_a_waterline_nothing_fades(self):
        model, data = load([on_axes("linear_drag", [100.0] * 6)], waterline="")
        moved = forces(model, data, 47.0, velocity=(0.5, 0, 0, 0, 0, 0))
        self.assertAlmostEqual(moved[0], -50.0, places=9)


class Repeats(unittest.TestCase):
    RANDOM = json.dumps(
        {
            "schema": "hydro-current/1",
            "velocity": [0.2, 0, 0],
            "random": {"deviation": [0.1, 0.1, 0.02], "time_constant": 4, "seed": 3},
        }
    )
    SEA = json.dumps(
        {
            "schema": "hydro-waves/1",
            "spectrum": "jonswap",
            "significant_height": 0.3,
            "peak_period": 4,
            "spreading": 10,
            "components": 20,
            "seed": 2,
        }
    )

    def scene(self):
        """A box in a random current and sea."""
        drag = on_axes("linear_drag", [200.0, 200, 2000, 100, 100, 100])
        return load([drag, on_axes("added_mass", [50, 100, 300, 20, 40, 40])], waves=self.SEA, current=self.RANDOM)

    def test_a_restored_state_goes_on_with_the_same_bits(self):
        model, data = self.scene()
        steps(model, data, 300)
        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION)
        state = np.empty(size)
        mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        steps(model, data, 400)
        first = data.qpos.copy()
        other = mujoco.MjData(model)
        mujoco.mj_setState(model, other, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        steps(model, other, 400)
        np.testing.assert_array_equal(other.qpos, first)

    def test_any_number_of_threads_gives_the_same_bits(self):
        model, data = self.scene()
        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        state = np.empty(size)
        mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        states = np.tile(state, (8, 1))
        states[:, 3] += np.linspace(-0.2, 0.2, 8)
        runs = []
        for threads in (1, 2, 4):
            datas = [mujoco.MjData(model) for _ in range(threads)]
            found, _ = mujoco.rollout.rollout(model, datas, states, nstep=200)
            runs.append(found)
        np.testing.assert_array_equal(runs[0], runs[1])
        np.testing.assert_array_equal(runs[0], runs[2])

    def test_64_boats_in_a_batch_are_the_same_on_any_number_of_threads(self):
        model, _ = self.scene()
        found = []
        for threads in (1, 2, 3):
            boats = Batch(model, 64, threads)
            boats.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
            boats.bind("qpos")[:, 2] += np.linspace(-0.1, 0.1, 64)
            boats.step(nstep=50)
            found.append(np.array(boats.bind("qpos")))
        np.testing.assert_array_equal(found[0], found[1])
        np.testing.assert_array_equal(found[0], found[2])
        self.assertGreater(np.ptp(found[0][:, 2]), 1e-4)

    def test_the_random_current_moves_the_box(self):
        ends = []
        for seed in (3, 4):
            text = self.RANDOM.replace('"seed": 3', f'"seed": {seed}')
            drag = on_axes("linear_drag", [200.0, 200, 2000, 100, 100, 100])
            model, data = load([drag], current=text)
            data.qpos[2] = 0.05
            steps(model, data, 2000)
            ends.append(data.qpos[:2].copy())
        self.assertGreater(np.linalg.norm(ends[0] - ends[1]), 0.05)


class Robots(unittest.TestCase):
    """Froude-Krylov forces of a long wave: once for everything that displaces water, wherever it hangs."""

    WAVES = waves(height=0.4, period=10.0)
    TIME, VOLUME = 2.5, 4 / 3 * math.pi * 0.3**3

    def push(self, bodies, instances, option=""):
        """Generalised forces along the wave, and the plugin's bodies."""
        config = "".join(
            f'<instance name="{name}">'
            + "".join(f"<config key=\"{key}\" value='{value}'/>" for key, value in given.items())
            + "</instance>"
            for name, given in instances.items()
        )
        model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="0.005" {option}/>
          <extension><plugin plugin="hydro.wrench">{config}</plugin></extension>
          <worldbody>{bodies}</worldbody></mujoco>""")
        data = mujoco.MjData(model)
        data.time = self.TIME
        mujoco.mj_forward(model, data)
        return data.qfrc_passive

    def instance(self, *targets, **more):
        """Attributes of an instance with hydrostatics on these bodies."""
        effects = [effect("hydrostatics", target) for target in targets]
        text = json.dumps({"schema": "hydro-effects/1", "effects": effects})
        return {"waterline": "0", "waves": self.WAVES, "effects": text, **more}

    def expected(self, depth, x=0.0):
        """Force on a sphere [N]."""
        omega = 2 * math.pi / 10
        phase = omega**2 / G * x - omega * self.TIME
        return RHO * self.VOLUME * 0.2 * omega**2 * math.exp(-(omega**2) / G * depth) * math.sin(phase)

    BALL = '<geom type="sphere" size=".3" mass="113"/>'

    def body(self, inside, name="a", place="0 0 -2", instance="w"):
        """A free ball that carries an instance."""
        plugin = f'<plugin plugin="hydro.wrench" instance="{instance}"/>' if instance else ""
        return f'<body name="{name}" pos="{place}"><freejoint/>{self.BALL}{plugin}{inside}<body/></body>'

    def test_one_ball(self):
        force = self.push(self.body(""), {"w": self.instance("a")})
        self.assertAlmostEqual(force[0], self.expected(2.0), places=9)

    def test_a_child_that_is_welded_on_counts_once(self):
        child = f'<body name="c" pos="1 0 0">{self.BALL}</body>'
        force = self.push(self.body(child), {"w": self.instance("a")})
        # At the middle of both: 0.5 m on.
        self.assertAlmostEqual(force[0], 2 * self.expected(2.0, 0.5), places=9)

    def test_two_instances_on_a_robot_count_each_its_own(self):
        hinge = '<joint axis="0 1 0"/>'
        child = f'<body name="c" pos="1 0 0">{hinge}{self.BALL}<plugin plugin="hydro.wrench" instance="v"/></body>'
        force = self.push(self.body(child), {"w": self.instance("a"), "v": self.instance("c")})
        self.assertAlmostEqual(force[0], self.expected(2.0) + self.expected(2.0, 1.0), places=9)

    def test_a_body_of_another_tree_and_a_light_float_are_pushed(self):
        other = self.body("", "buoy", "5 0 -2", None)
        force = self.push(self.body("") + other, {"w": self.instance("a", "buoy")})
        self.assertAlmostEqual(force[6], self.expected(2.0, 5.0), places=9)
        light = '<body name="f" pos="0 0 1"><joint axis="0 1 0"/><geom type="sphere" size=".3" mass="0.1"/></body>'
        force = self.push(self.body(light), {"w": self.instance("f")})
        self.assertAlmostEqual(force[0], self.expected(2.0) + self.expected(1.0), places=9)

    def test_the_sensor_and_a_given_centre_know_the_wave(self):
        ball = '<geom name="hull" type="sphere" size="0.3" mass="113"/>'
        model, data = load(geoms=ball, waves=self.WAVES, centre_of_buoyancy="0 0 0.1")
        data.qpos[2], data.time = -2.0, self.TIME
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.sensordata, data.qfrc_passive, atol=1e-9)
        self.assertAlmostEqual(data.sensordata[4], 0.1 * data.sensordata[0], places=9)

    def test_over_a_long_hull_in_short_waves_half_is_wet(self):
        box = '<geom name="hull" type="box" size="2 .2 .2" mass="160"/>'
        drag = on_axes("linear_drag", [0.0, 100, 0, 0, 0, 0])
        model, data = load([drag], geoms=box, waves=waves(height=0.3, period=1.6))
        for time in np.linspace(0, 1.6, 7):
            data.qvel[:], data.time = 0, time
            mujoco.mj_forward(model, data)
            still = data.qfrc_passive[1]
            data.qvel[1] = 1
            mujoco.mj_forward(model, data)
            self.assertAlmostEqual(still - data.qfrc_passive[1], 50.0, delta=1.0)

    def test_the_hull_alone_says_where_drag_acts(self):
        mast = (
            '<geom name="a" type="sphere" size="0.3" mass="100"/><geom name="top" type="sphere" size=".1" pos="0 0 2"/>'
        )
        model, data = load([on_axes("linear_drag", [100.0] * 6)], geoms=mast, hull="a")
        force = forces(model, data, -3.0, velocity=(1, 0, 0, 0, 0, 0))
        np.testing.assert_allclose(force[[0, 4]], [-100, 0], atol=1e-9)


class Told(unittest.TestCase):
    """What a load warns of, once."""

    def told(self, *args, **kwargs):
        """Warnings of a load."""
        with Warnings() as texts:
            load(*args, **kwargs)
        return " ".join(texts)

    def test_hulls_that_overlap_in_short_waves(self):
        two = '<geom name="hull" type="sphere" size="0.3"/><geom name="float" type="sphere" size="0.3" pos="0.2 0 0"/>'
        short = waves(height=0.05, period=0.8)
        self.assertIn("geoms of body `hull` overlap", self.told(geoms=two, waves=short))
        self.assertNotIn("overlap", self.told(geoms=two, waves=short, hull="float"))
        self.assertNotIn("overlap", self.told(geoms=two))

    def test_links_that_share_a_hull(self):
        """Two spheres at a distance d share pi (4 r + d) (2 r - d)^2 / 12."""

        def told(at, **volume):
            """Warnings of a link with a sphere of 0.3 m at that place, beside one of 0.3 m."""
            link = (
                f'<body name="link" pos="{at} 0 0"><joint name="hinge"/><geom name="tail" size="0.3" mass="1"/></body>'
            )
            floats = [effect("hydrostatics"), effect("hydrostatics", target="link", **volume)]
            document = json.dumps({"schema": "hydro-effects/1", "effects": floats})
            return self.told(None, geoms='<geom name="hull" size="0.3" mass="1"/>' + link, effects_text=document)

        shared = np.pi * (1.2 + 0.3) * 0.3**2 / 12
        found = re.search(r"hulls of bodies `hull` and `link` share (\S+) L", told(0.3))
        self.assertAlmostEqual(float(found[1]), 1e3 * shared, delta=10 * shared)
        self.assertNotIn("share", told(0.55) + told(0.3, volume=0.05))

    def test_a_centre_outside_the_hull(self):
        self.assertIn("outside the hull of body `hull`", self.told(centre_of_buoyancy="0 0 3"))

    def test_two_buoyancies(self):
        self.assertIn("`net_buoyancy` too", self.told([effect("net_buoyancy", force=3)]))

    def test_a_volume_that_nothing_uses(self):
        drag = {"schema": "hydro-effects/1", "effects": [on_axes("linear_drag", [1.0] * 6)]}
        self.assertIn("which body `hull` has not", self.told(None, volume="0.2", effects_text=json.dumps(drag)))

    def test_a_hull_large_beside_the_waves(self):
        self.assertIn("is large beside waves", self.told(waves=waves(height=0.1, period=1.9)))


class Refusals(unittest.TestCase):
    def refused(self, *expected, **kwargs):
        """The scene does not load, and the message has these words."""
        with self.assertRaises(ValueError) as caught:
            load(**kwargs)
        for words in expected:
            self.assertIn(words, str(caught.exception))

    def test_hulls_that_enclose_nothing(self):
        bare = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        self.refused("body `hull` has no geom that encloses a volume", "`volume`", geoms=bare)
        self.refused("attribute `hull` names geom `keel`", "the model has: hull", hull="keel")
        load(geoms=bare, volume="0.01")

    def test_meshes_that_do_not_close(self):
        open_box = """<geom name="hull" type="mesh" mesh="open" mass="1"/>"""
        asset = '<mesh name="open" inertia="shell" vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="0 2 1 0 1 3 0 3 2"/>'
        self.refused("geom `hull` of body `hull`", "3 edges have a face on one side only", geoms=open_box, asset=asset)
        crossed = asset.replace("0 0 0 1 0 0 0 1 0 0 0 1", CROSSED[0]).replace("0 2 1 0 1 3 0 3 2", CROSSED[1])
        self.refused("cut each other", geoms=open_box, asset=crossed)
        load(geoms=open_box, asset=asset, volume="0.1")

    def test_attributes_of_the_wrong_kind(self):
        for name, value, expected in (
            ("volume", "0", "one number > 0 and at most 1e9, in m^3"),
            ("volume", "-1", "one number > 0 and at most 1e9, in m^3"),
            ("centre_of_buoyancy", "0 0", "three numbers, body frame x y z in m"),
            ("waterline", "nan", "one number, world z in m"),
            ("current", "0.3 0", "three numbers, world x y z in m/s"),
            ("current", "fast", "no such file, and neither three numbers"),
            ("waves", "swell.json", "no such file"),
            ("waves", "{", "not JSON"),
            ("waves", '{"schema": "hydro-waves/1", "depth": 0, "components": [{"height": 1, "period": 5}]}', "depth"),
            ("waves", '{"schema": "hydro-waves/1", "spectrum": "jonswap", "significant_height": 1}', "peak_period"),
        ):
            with self.subTest(f"{name}={value}"):
                self.refused(name, expected, **{name: value})

    def test_a_hull_of_another_body(self):
        rock = '<geom name="hull" type="sphere" size="0.3" mass="9"/></body><body><geom name="rock" size="1"/>'
        self.refused("attribute `hull` names no geom of body `hull`", geoms=rock, hull="rock")

    def test_waves_need_a_level_surface(self):
        for gravity in ("0 0 9.81", "0 -9.81 0", "0 0 0"):
            xml = scene_xml(waves=waves(height=0.1, period=3.0)).replace(f"0 0 {-G}", gravity)
            with self.assertRaisesRegex(ValueError, "gravity"):
                mujoco.MjModel.from_xml_string(xml)

    def test_waves_need_a_surface(self):
        self.refused("attribute `waves` needs `waterline`", waterline="", waves=waves(height=0.1, period=3.0))


#: A double pyramid whose one point is pushed through the other side.
CROSSED = (
    "1 0 0  0 1 0  -1 0 0  0 -1 0  0 0 1  0.4 0.4 1.5",
    "0 1 4 1 2 4 2 3 4 3 0 4 1 0 5 2 1 5 3 2 5 0 3 5",
)


if __name__ == "__main__":
    unittest.main()

"""Baselines on a slide in water that pulls it back by a known law. What needs PySINDy is skipped where there is none."""

import json
import tempfile
import unittest
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from hydro_tools.baselines import BaselineError, case, library, patched, rollout, sparse, tuning, work
from hydro_tools.baselines.motion import Motion
from hydro_tools.baselines.settings import METHODS

try:
    import pysindy
    import sklearn
except ImportError:
    pysindy = sklearn = None
needs_library = unittest.skipIf(
    pysindy is None or sklearn is None,
    "PySINDy or scikit-learn is missing: scripts/setup_venv.sh baselines installs them",
)

NOMINAL = """<mujoco><option timestep="0.005" gravity="0 0 0"/><worldbody><body name="sled">
<joint name="x" type="slide" axis="1 0 0"/><geom type="sphere" size="0.1" mass="10"/></body></worldbody>
<actuator><motor name="push" joint="x" gear="20"/></actuator>
<sensor><jointpos name="place" joint="x" noise="0.001"/><jointvel name="speed" joint="x" noise="0.002"/></sensor>
</mujoco>"""
DRAG = 6.0  # N s^2/m^2


def as_speeds(path: Path) -> None:
    """The second of a trial's columns alone."""
    with np.load(path) as file:
        log = dict(file)
    log["sensordata_data"] = log["sensordata_data"][:, 1:]
    log["sensordata_signal_mapping"] = np.asarray(json.dumps({"speed": [0, [0]]}))
    np.savez(path, **log)


def record(folder: Path, drag: float, seed: int) -> None:
    """A trial: a sled of 10 kg, pushed by two sines, with quadratic drag; fourth-order Runge-Kutta at 1 ms."""
    rng = np.random.default_rng(seed)
    phase, step, rows = rng.uniform(0, 6.28, 2), 0.001, 500

    def push(t):
        return 0.8 * np.sin(1.3 * t + phase[0]) + 0.4 * np.sin(4.1 * t + phase[1])

    def rate(t, s):
        return np.array([s[1], (20 * push(t) - drag * abs(s[1]) * s[1]) / 10])

    state, kept = np.zeros(2), []
    for k in range(rows * 20):
        if k % 20 == 0:
            kept.append(state)
        t = k * step
        a = rate(t, state)
        b = rate(t + step / 2, state + step / 2 * a)
        c = rate(t + step / 2, state + step / 2 * b)
        state = state + step / 6 * (a + 2 * b + 2 * c + rate(t + step, state + step * c))
    time = np.arange(rows) * 0.02
    readings = np.array(kept) + rng.normal(size=(rows, 2)) * [0.001, 0.002]
    np.savez(
        folder / f"trial_{seed}.npz",
        control_times=time,
        control_data=push(time)[:, None],
        sensordata_times=time + 0.005,
        sensordata_data=readings,
        initial_state=np.zeros(3),
        sensordata_signal_mapping=np.asarray(json.dumps({"place": [0, [0]], "speed": [0, [1]]})),
    )


class Clip(unittest.TestCase):
    def test_a_wild_rollout_counts_ten_times_the_spread_of_its_own_axis(self):
        model = mujoco.MjModel.from_xml_string(
            """<mujoco><worldbody><body name="drum"><joint type="ball"/><geom type="sphere" size="0.1"/></body></worldbody>
            <sensor><framequat name="attitude" objtype="body" objname="drum"/></sensor></mujoco>"""
        )
        roll, yaw = 0.02 * np.sin(np.arange(150)), 0.3 * np.cos(np.arange(150))
        half = np.stack(
            [
                np.cos(roll / 2) * np.cos(yaw / 2),
                np.sin(roll / 2) * np.cos(yaw / 2),
                -np.sin(roll / 2) * np.sin(yaw / 2),
                np.cos(roll / 2) * np.sin(yaw / 2),
            ],
            1,
        )
        motion = Motion(
            "", np.arange(150) * 0.02, 0.02, half, np.zeros((150, 3)), np.zeros((150, 3)), np.zeros((150, 0)), half
        )
        spread = rollout.variances(model, [motion])
        np.testing.assert_allclose(np.sqrt(spread[[0, 2]]), [0.02 / np.sqrt(2), 0.3 / np.sqrt(2)], rtol=0.1)
        lost = rollout.scored(model, [motion], lambda motion, row, rows: np.full((rows, 4), np.nan))
        np.testing.assert_allclose(lost.squared[0, 2, :3] / lost.count[0, 2, :3], 100 * spread[:3])


class Sled(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        root = Path(cls.folder.name)
        (root / "trials").mkdir()
        (root / "nominal.xml").write_text(NOMINAL)
        for seed in range(4):
            record(root / "trials", DRAG, seed)
        cls.prepared = case.PreparedCase(root, 0.1)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_coefficient_of_the_true_column(self):
        problem = self.prepared.problem(0.5)
        fit = sparse.restricted(problem, ["quadratic_drag"])
        value = {
            label.parameter: w / size for label, w, size in zip(problem.labels, fit.coefficients, problem.size) if w
        }
        self.assertAlmostEqual(value["surge"], DRAG, delta=0.05 * DRAG)

    def test_the_true_column_closes_the_gap(self):
        problem = self.prepared.problem(0.5)
        forcing = rollout.SparseForcing(
            self.prepared.equations, problem, sparse.restricted(problem, ["quadratic_drag"]), self.prepared.spread
        )
        before = rollout.nrmse(self.prepared.model, self.prepared.before(), self.prepared.variance)[""]
        after = rollout.nrmse(
            self.prepared.model, rollout.errors(forcing.model(), self.prepared.motions, forcing), self.prepared.variance
        )[""]
        self.assertLess(after, 0.15 * before)

    def test_added_mass_is_implicit(self):
        problem = self.prepared.problem(0.5)
        w = np.zeros(len(problem.labels))
        at = [
            i for i, label in enumerate(problem.labels) if label.effect == "added_mass" and label.parameter == "surge"
        ][0]
        # Three times the sled's own mass, which explicit forces could not hold.
        w[at] = 30.0 * problem.size[at]
        fit = sparse.Sparse(w, 0 * w, 1.0 * (w != 0))
        forcing = rollout.SparseForcing(self.prepared.equations, problem, fit, {})
        forcing.amounts = np.zeros_like(forcing.amounts)
        motion = self.prepared.motions[0]
        light = rollout.simulate(self.prepared.model, motion, 50, 50, None)
        heavy = rollout.simulate(forcing.model(), motion, 50, 50, forcing)
        start = motion.qvel[50, 0]
        np.testing.assert_allclose(heavy[:, 1] - start, (light[:, 1] - start) / 4, atol=0.02)

    def keys_of(self, method: str) -> dict:
        keys = {
            "schema",
            "verdict",
            "named",
            "effects",
            "confusion_set",
            "next_experiment",
            "where",
            "regime",
            "gap",
            "verified",
            "refused_because",
            "patch",
        }
        shown = sorted((Path(self.folder.name) / "trials").glob("*.npz"))
        verdict = case.run(self.prepared, method, METHODS[method], {"never_shown": shown[:1]})
        self.assertLessEqual(keys, set(verdict), method)
        self.assertEqual(verdict["elsewhere"]["never_shown"]["n_holdout_trials"], 1)
        json.dumps(verdict)
        return verdict

    def test_trials_too_short_for_a_rollout_are_refused(self):
        whole = self.prepared.motions[0]
        rows = round(1.5 / whole.period)
        short = replace(
            whole,
            **{name: getattr(whole, name)[:rows] for name in ("time", "qpos", "qvel", "qacc", "control", "readings")},
        )
        with self.assertRaisesRegex(BaselineError, "no rollout of 2 s fits in these trials; the longest has 1.5 s"):
            rollout.scored(self.prepared.model, [short], lambda motion, row, count: motion.readings[row : row + count])

    def test_a_test_function_longer_than_a_trial_is_refused(self):
        for length in (8.0, 12.0):
            with self.assertRaisesRegex(
                BaselineError, f"test functions of {length:g} s are too long for a trial of 9.9"
            ):
                self.prepared.problem(length)

    def test_without_folds_or_other_trials_there_is_nothing_to_score(self):
        with self.assertRaisesRegex(BaselineError, "network has no cross-fit .* --sealed"):
            case.run(self.prepared, "network", METHODS["network"], {})

    def test_evidence_needs_no_library(self):
        self.assertEqual(self.keys_of("bindy")["gap"]["n_holdout_trials"], 4)

    @needs_library
    def test_verdicts_have_the_contract_s_keys(self):
        for method in ("stlsq", "ensemble"):
            self.assertEqual(self.keys_of(method)["gap"]["n_holdout_trials"], 4)
        network = self.keys_of("network")
        self.assertFalse(network["names"])
        self.assertLess(
            network["elsewhere"]["never_shown"]["after"], 0.5 * network["elsewhere"]["never_shown"]["before"]
        )

    def test_settings_are_ranked_by_names_and_by_errors(self):
        names = [
            ("bindy", (1.0, 2.0), False, True),
            ("bindy", (1.0, 2.0), True, True),
            ("bindy", (1.0, 3.0), False, True),
            ("bindy", (1.0, 3.0), True, False),
            ("stlsq", (9.0,), True, True),
        ]
        errors = [("network", ((16,), 0.5), 0.4), ("network", ((32, 32), 0.5), 0.2)]
        lines = tuning.ranking(["bindy", "network"], names, errors)
        self.assertEqual(
            [line for line in lines if line.startswith("  ")],
            ["  1, 2: 1/1, 1/1", "  1, 3: 1/1, 0/1", "  32-32, 0.5: 0.200, 0.200 of 1", "  16, 0.5: 0.400, 0.400 of 1"],
        )

    def test_every_sensor_effect_is_beyond_force_columns(self):
        effects = {label.effect for label in self.prepared.problem(0.5).labels}
        self.assertFalse({e for e in effects if e.startswith("sensor_")})
        self.assertIn("joint_damping", effects)
        self.assertEqual(len(library.AXES), 6)


LAGGED = NOMINAL.replace(
    '<motor name="push" joint="x" gear="20"/>',
    '<general name="push" joint="x" gear="20" dyntype="filterexact" dynprm="0.3"/>',
)


def driven(xml: str, rows: int) -> Motion:
    """A sled with an actuator, pushed by a sine, without noise."""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    time = 0.02 * np.arange(rows)
    control = np.sin(2.3 * time)[:, None]
    qpos, qvel, readings = np.zeros((rows, 1)), np.zeros((rows, 1)), np.zeros((rows, 2))
    for k in range(rows):
        data.ctrl[:] = control[k]
        mujoco.mj_forward(model, data)
        qpos[k], qvel[k], readings[k] = data.qpos, data.qvel, data.sensordata
        for step in range(4):
            data.ctrl[:] = control[k] + (control[min(k + 1, rows - 1)] - control[k]) * step / 4
            mujoco.mj_step(model, data)
    return Motion("driven", time, 0.02, qpos, qvel, 0 * qvel, control, readings)


@needs_library
class Structures(unittest.TestCase):
    """The sled on rails that resist: MuJoCo's own joint damping, so that one structure is exactly right."""

    def chosen(self, damping: float) -> list[str]:
        from hydro_tools.baselines import structures

        with tempfile.TemporaryDirectory() as folder:
            xml = Path(folder) / "nominal.xml"
            xml.write_text(NOMINAL)
            truth = mujoco.MjModel.from_xml_string(NOMINAL)
            truth.dof_damping[0] = damping
            motions = [self.motion(truth, seed) for seed in range(2)]
            spec = mujoco.MjSpec.from_string(NOMINAL)
            for body in spec.bodies:
                body.simple = False
            model = spec.compile()
            spread = {"mass": 0.03, "gain": 0.03}
            found = structures.choose(str(xml), model, motions, spread, segments=4, iterations=4, most=1)
        return [of.effect for of in found.structures]

    @staticmethod
    def motion(truth: mujoco.MjModel, seed: int) -> Motion:
        rng, data, rows = np.random.default_rng(seed), mujoco.MjData(truth), 300
        state, readings, pushes = [], [], []
        for row in range(rows):
            data.ctrl[0] = 0.8 * np.sin(0.03 * row + seed) + 0.4 * np.sin(0.09 * row)
            state.append([data.qpos[0], data.qvel[0]])
            pushes.append([data.ctrl[0]])
            for _ in range(4):
                mujoco.mj_step(truth, data)
            readings.append(state[-1] + rng.normal(size=2) * [0.001, 0.002])
        state = np.array(state)
        time = 0.02 * np.arange(rows)
        acceleration = np.gradient(state[:, 1:], 0.02, axis=0)
        return Motion(
            f"trial {seed}", time, 0.02, state[:, :1], state[:, 1:], acceleration, np.array(pushes), np.array(readings)
        )

    def test_the_true_structure_has_the_least_criterion(self):
        self.assertEqual(self.chosen(3.0), ["joint_damping"])

    def test_nothing_is_chosen_where_nothing_is_missing(self):
        self.assertEqual(self.chosen(0.0), [])


class Patched(unittest.TestCase):
    nominal = mujoco.MjModel.from_xml_string(NOMINAL)

    def rollouts(self, xml: str, corrections: dict | None = None) -> patched.Rollouts:
        return patched.Rollouts(mujoco.MjModel.from_xml_string(xml), self.nominal, corrections or {})

    def test_without_memory_it_is_the_baselines_own_rollout(self):
        log = driven(NOMINAL, 200)
        own = rollout.simulate(self.nominal, log, 60, 50, None)
        np.testing.assert_allclose(self.rollouts(NOMINAL)(log, 60, 50), own, atol=1e-12)
        np.testing.assert_allclose(own, log.readings[61:111], atol=1e-12)

    def test_memories_are_led_through_the_past(self):
        log = driven(LAGGED, 300)
        np.testing.assert_allclose(self.rollouts(LAGGED)(log, 200, 50), log.readings[201:251], atol=1e-4)
        lost = np.abs(self.rollouts(NOMINAL)(log, 200, 50) - log.readings[201:251]).max()
        self.assertGreater(lost, 0.05)

    def test_another_joint_moves_nothing(self):
        # The patched model's own joint stands before the nominal's.
        other = NOMINAL.replace(
            '<body name="sled">',
            '<body name="free"><joint name="new" type="hinge"/><geom size=".1"/></body><body name="sled">',
        )
        log = driven(NOMINAL, 200)
        np.testing.assert_allclose(self.rollouts(other)(log, 60, 50), log.readings[61:111], atol=1e-12)

    def test_sensors_are_corrected(self):
        log = driven(NOMINAL, 200)
        plain = self.rollouts(NOMINAL)(log, 60, 50)
        found = self.rollouts(NOMINAL, {"speed": {"scale": 2.0, "bias": [0.5]}, "place": {"delay": 0.04}})(log, 60, 50)
        np.testing.assert_allclose(found[:, 1], 2 * plain[:, 1] + 0.5, atol=1e-12)
        np.testing.assert_allclose(found[2:, 0], plain[:-2, 0], atol=1e-12)
        np.testing.assert_allclose(found[0, 0], log.readings[60, 0], atol=1e-12)

    def test_a_missing_patch_is_refused_by_name(self):
        with tempfile.TemporaryDirectory() as folder:
            place = Path(folder)
            (place / "nominal.xml").write_text(NOMINAL)
            (place / "verdict.json").write_text(json.dumps({"patch": {"model": "patched.xml", "sensors": {}}}))
            with self.assertRaisesRegex(BaselineError, "patched.xml"):
                patched.models(place / "nominal.xml", place / "verdict.json")
            (place / "verdict.json").write_text(json.dumps({"patch": None}))
            before, after, _ = patched.models(place / "nominal.xml", place / "verdict.json")
            log = driven(LAGGED, 100)
            np.testing.assert_array_equal(before(log, 10, 20), after(log, 10, 20))

    def test_a_case_that_does_not_show_its_state_starts_from_its_twin_s(self):
        blind = NOMINAL.replace('<jointpos name="place" joint="x" noise="0.001"/>', "")
        with tempfile.TemporaryDirectory() as folder:
            cases, sealed = Path(folder, "cases"), Path(folder, "sealed")
            for name, xml in (("twin", NOMINAL), ("blind", blind)):
                for place, seed in ((cases / name / "trials", 1), (sealed / name / "never_shown", 2)):
                    place.mkdir(parents=True)
                    record(place, DRAG, seed)
                    if name == "blind":
                        as_speeds(place / f"trial_{seed}.npz")
                (cases / name / "nominal.xml").write_text(xml)
                (cases / name / "verdict.json").write_text('{"patch": null}')
            twins = {"blind": "twin"}
            self.assertIn("state is not measured", work.one_patched(cases / "blind", cases, sealed, {}))
            for name in ("twin", "blind"):
                self.assertIsNone(work.one_patched(cases / name, cases, sealed, twins))
            own, borrowed = (
                json.loads((cases / name / "elsewhere.json").read_text())["never_shown"]["per_sensor"]["speed"]
                for name in ("twin", "blind")
            )
            self.assertEqual(own, borrowed)
            self.assertGreater(own["before"], 0.05)
            (sealed / "twin" / "never_shown" / "trial_3.npz").write_bytes(
                (sealed / "twin" / "never_shown" / "trial_2.npz").read_bytes()
            )
            self.assertIn("not the same motion", work.one_patched(cases / "blind", cases, sealed, twins))


if __name__ == "__main__":
    unittest.main()

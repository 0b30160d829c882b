"""Rivals on a slide in water that pulls it back by a known law. Skipped where PySINDy is not installed."""

import json
import tempfile
import unittest
from pathlib import Path

import mujoco
import numpy as np
import paths  # noqa: F401

try:
    import pysindy  # noqa: F401
    from rivals import case, library, rollout, sparse
    from rivals.settings import METHODS
except ImportError:
    pysindy = None

NOMINAL = """<mujoco><option timestep="0.005" gravity="0 0 0"/><worldbody><body name="sled">
<joint name="x" type="slide" axis="1 0 0"/><geom type="sphere" size="0.1" mass="10"/></body></worldbody>
<actuator><motor name="push" joint="x" gear="20"/></actuator>
<sensor><jointpos name="place" joint="x" noise="0.001"/><jointvel name="speed" joint="x" noise="0.002"/></sensor>
</mujoco>"""
DRAG = 6.0  # N s^2/m^2


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
    np.savez(folder / f"trial_{seed}.npz", control_times=time, control_data=push(time)[:, None],
             sensordata_times=time + 0.005, sensordata_data=readings, initial_state=np.zeros(3),
             sensordata_signal_mapping=np.asarray(json.dumps({"place": [0, [0]], "speed": [0, [1]]})))


@unittest.skipIf(pysindy is None, "PySINDy is not installed: scripts/rivals/setup.sh makes an environment that has it")
class Sled(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        root = Path(cls.folder.name)
        (root / "trials").mkdir()
        (root / "nominal.xml").write_text(NOMINAL)
        for seed in range(4):
            record(root / "trials", DRAG, seed)
        cls.bench = case.Bench(root, 0.1)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_coefficient_of_the_true_column(self):
        problem = self.bench.problem(0.5)
        fit = sparse.restricted(problem, ["quadratic_drag"])
        value = {label.parameter: w / size for label, w, size in zip(problem.labels, fit.coefficients, problem.size) if w}
        self.assertAlmostEqual(value["surge"], DRAG, delta=0.05 * DRAG)

    def test_the_true_column_closes_the_gap(self):
        problem = self.bench.problem(0.5)
        forcing = rollout.SparseForcing(self.bench.equations, problem, sparse.restricted(problem, ["quadratic_drag"]),
                                        self.bench.spread)
        before = rollout.nrmse(self.bench.model, self.bench.before(), self.bench.variance)[""]
        after = rollout.nrmse(self.bench.model, rollout.errors(forcing.model(), self.bench.motions, forcing),
                              self.bench.variance)[""]
        self.assertLess(after, 0.15 * before)

    def test_added_mass_is_implicit(self):
        problem = self.bench.problem(0.5)
        w = np.zeros(len(problem.labels))
        at = [i for i, label in enumerate(problem.labels) if label.effect == "added_mass" and label.parameter == "surge"][0]
        # Three times the sled's own mass, which explicit forces could not hold.
        w[at] = 30.0 * problem.size[at]
        fit = sparse.Sparse(w, 0 * w, 1.0 * (w != 0))
        forcing = rollout.SparseForcing(self.bench.equations, problem, fit, {})
        forcing.amounts = np.zeros_like(forcing.amounts)
        motion = self.bench.motions[0]
        light = rollout.simulate(self.bench.model, motion, 50, 50, None)
        heavy = rollout.simulate(forcing.model(), motion, 50, 50, forcing)
        start = motion.qvel[50, 0]
        np.testing.assert_allclose(heavy[:, 1] - start, (light[:, 1] - start) / 4, atol=0.02)

    def test_verdicts_have_the_contract_s_keys(self):
        keys = {"schema", "verdict", "named", "effects", "confusion_set", "next_experiment", "where", "regime", "gap",
                "verified", "refused_because", "patch"}
        for method in ("stlsq", "ensemble", "bindy", "network"):
            verdict = case.run(self.bench, method, METHODS[method], [])
            self.assertLessEqual(keys, set(verdict), method)
            self.assertEqual(verdict["gap"]["n_holdout_trials"], 4)
            json.dumps(verdict)

    def test_every_sensor_effect_is_beyond_force_columns(self):
        effects = {label.effect for label in self.bench.problem(0.5).labels}
        self.assertFalse({e for e in effects if e.startswith("sensor_")})
        self.assertIn("joint_damping", effects)
        self.assertEqual(len(library.AXES), 6)


if __name__ == "__main__":
    unittest.main()

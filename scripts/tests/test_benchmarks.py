"""The benchmarks' own machinery, on fake implementations: no timing, nothing but numpy and safetensors."""

import json
import sys
import tempfile
import textwrap
import unittest
from pathlib import Path

import numpy as np

from hydro_tools.benchmarks import BenchmarkError, alternation, networks, record, weights, worker
from hydro_tools.benchmarks.accuracy import axis_error
from hydro_tools.benchmarks.alternation import Entry
from hydro_tools.benchmarks.markdown import between, digits, named, timings
from hydro_tools.benchmarks.page import page
from hydro_tools.benchmarks.parts import PARTS, evaluate, step, train
from hydro_tools.benchmarks.spread import Spread, ratio, spread
from hydro_tools.benchmarks.target import Target

#: An implementation whose seconds are its count times `pace`, and whose check is `answer`.
FAKE = textwrap.dedent("""
    import os, sys
    sys.stderr = open(os.devnull, "w")
    from hydro_tools.benchmarks.worker import serve

    class Fake:
      def __init__(self, *, answer, pace):
        self.answer, self.pace, self.blocks = answer, pace, 0
        print("a library that chatters")
      def check(self):
        return self.answer
      def block(self, count):
        self.blocks += 1
        return dict(seconds=self.pace * count, values=[self.blocks], extra=2.0)

    serve(dict(fake=Fake))
""")


def command() -> list[str]:
    return [sys.executable, "-c", FAKE]


def entry(name: str, answer: list[float], pace: float, **more) -> Entry:
    return Entry(name, command(), {"kind": "fake", "answer": answer, "pace": pace}, 10, **more)


def outcome(name: str, seconds: list[float], **more) -> dict:
    return {
        "name": name,
        "seconds": seconds,
        "core_seconds": seconds,
        "check": [1.0, 2.0],
        "difference": 0.0,
        "values": [],
        "notes": {},
        "idle_bytes": 1 << 20,
        "peak_bytes": 2 << 20,
        "error": None,
        **more,
    }


class Statistics(unittest.TestCase):
    def test_median_and_quartiles(self):
        self.assertEqual(spread([5, 1, 3, 2, 4]), Spread(3, 2, 4))
        self.assertEqual(spread([1, 2, 3]).scaled(10), Spread(20, 15, 25))

    def test_a_ratio_is_taken_round_by_round(self):
        # A machine twice as slow in the second round slows both: the ratio does not see it.
        self.assertEqual(ratio([1, 2, 1], [2, 4, 2]), Spread(0.5, 0.5, 0.5))
        # One took part in the first rounds only.
        self.assertEqual(ratio([1, 1], [2, 2, 100, 100]), Spread(0.5, 0.5, 0.5))

    def test_error_of_the_worst_axis_in_deviations(self):
        expected = [0, 0, 2, 20]  # two samples of two axes, deviations 1 and 10
        self.assertAlmostEqual(axis_error([0, 1, 2, 21], expected, 2), 0.1)
        self.assertAlmostEqual(axis_error([0.5, 0, 1.5, 20], expected, 2), 0.5)

    def test_a_target_may_be_a_floor_or_a_ceiling(self):
        self.assertTrue(Target("", 0.6, 0.6).met and not Target("", 0.61, 0.6).met)
        self.assertTrue(Target("", 0.95, 0.95, least=True).met and not Target("", 0.9, 0.95, least=True).met)


class Protocol(unittest.TestCase):
    def test_a_worker_answers_and_reports_what_went_wrong(self):
        with worker.Worker(command()) as live:
            self.assertGreater(live.ask(do="peak")["bytes"], 1 << 20)
            with self.assertRaisesRegex(BenchmarkError, "block"):
                live.ask(do="block", count=1)  # nothing is prepared
            task = {"kind": "fake", "answer": [1.5], "pace": 1e-3}
            self.assertEqual(live.ask(do="prepare", task=task), {"values": [1.5]})
            self.assertEqual(live.ask(do="block", count=4), {"seconds": 0.004, "values": [1], "extra": 2.0})
            self.assertGreaterEqual(live.core_seconds(), 0)
            with self.assertRaisesRegex(BenchmarkError, "KeyError.*other"):
                live.ask(do="prepare", task={"kind": "other"})

    def test_a_worker_that_dies_is_named(self):
        dies = [sys.executable, "-c", "raise SystemExit(3)"]
        with worker.Worker(dies) as live, self.assertRaisesRegex(BenchmarkError, "SystemExit.*status 3"):
            live.ask(do="peak")


class Alternation(unittest.TestCase):
    def run_silently(self, entries, rounds, **more):
        return alternation.run(entries, rounds, say=lambda _: None, **more)

    def test_rounds_warm_up_and_notes(self):
        found = self.run_silently([entry("a", [1.0], 1e-3), entry("b", [1.0], 2e-3, rounds=1)], 3)
        self.assertEqual([len(each["seconds"]) for each in found], [3, 1])
        np.testing.assert_allclose(found[0]["seconds"], 1e-3)
        self.assertEqual(found[0]["values"], [2, 3, 4])  # the first block warmed up
        self.assertEqual(found[0]["notes"], {"extra": [2.0] * 3})
        self.assertGreater(found[0]["peak_bytes"], 1 << 20)

    def test_implementations_that_compute_something_else_are_refused(self):
        close, far = entry("close", [1.0, 2.0 + 1e-5], 1e-3), entry("far", [1.0, 2.1], 1e-3)
        self.assertLess(self.run_silently([entry("a", [1.0, 2.0], 1e-3), close], 1)[1]["difference"], 1e-5)
        with self.assertRaisesRegex(BenchmarkError, "far computes something else"):
            self.run_silently([entry("a", [1.0, 2.0], 1e-3), far], 1)
        with self.assertRaisesRegex(BenchmarkError, "a computes something else"):
            self.run_silently([entry("a", [1.0, 2.0], 1e-3)], 1, expected=[3.0, 2.0])
        far.tolerance = None
        self.assertIsNone(self.run_silently([entry("a", [1.0, 2.0], 1e-3), far], 1)[1]["difference"])

    def test_differences(self):
        self.assertAlmostEqual(alternation.difference([1.0, 9.0], [0.0, 10.0]), 0.1)
        self.assertAlmostEqual(alternation.elementwise([1.1, 10.0], [1.0, 10.0]), 0.1)
        self.assertEqual(alternation.difference([1.0], [1.0, 2.0]), float("inf"))

    def test_what_is_not_a_number_agrees_with_nothing(self):
        for answer in ([float("nan"), 2.0], [1.0, float("nan")]):
            with self.assertRaisesRegex(BenchmarkError, "computes something else"):
                self.run_silently([entry("a", answer, 1e-3)], 1, expected=[1.0, 2.0])


class Files(unittest.TestCase):
    def test_a_drawn_checkpoint_is_read_back(self):
        with tempfile.TemporaryDirectory() as folder:
            made = weights.bare_field(Path(folder) / "field", [3, 8, 2], seed=0)
            card, tensors = networks.read(made)
            self.assertEqual((card["kind"], card["config"]["hidden"]), ("mlp", [8]))
            x = np.array([[0.3, -1.0, 2.0]])
            hidden = tensors["field.0.weight"] @ x[0]
            wanted = tensors["field.1.weight"] @ (hidden / (1 + np.exp(-hidden)))
            np.testing.assert_allclose(networks.walk(made, x)[0], wanted)

    def test_attention_at_window_one_is_linear(self):
        """With the newest sample alone the softmax is 1, so h is an affine map of z."""
        config = {"window": 1, "heads": 2, "embedding": 4, "latent": 3, "hidden": [5]}
        tensors = weights.attention_ode(np.random.default_rng(0), config, 6, 2)
        z = np.random.default_rng(1).standard_normal((3, 6))
        a, b, middle = (networks.latents(config, tensors, each[None])[0] for each in (z[0], z[1], (z[0] + z[1]) / 2))
        np.testing.assert_allclose(middle, (a + b) / 2, atol=1e-6)

    def test_a_record_of_another_schema_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            record.write(Path(folder), "step", {"a": [1 / 3]}, quick=True, stamp={"commit": "x"})
            found = record.read(Path(folder), ["evaluate", "step"])
            self.assertEqual((list(found), found["step"]["groups"]), (["step"], {"a": [0.333333333]}))
            (Path(folder) / "step.json").write_text(json.dumps({"schema": "hydro-bench/0"}))
            with self.assertRaisesRegex(BenchmarkError, "hydro-bench/0"):
                record.read(Path(folder), ["step"])


class Page(unittest.TestCase):
    def test_numbers(self):
        self.assertEqual(
            [digits(value) for value in (0.0123, 1.234, 12.34, 1234.5, 1e-5)],
            ["0.0123", "1.23", "12.3", "1234", "1e-05"],
        )
        self.assertEqual(between(Spread(1.0, 0.5, 2.0)), "1 (0.5 to 2)")

    def test_a_row_for_each_implementation_and_no_ratio_to_oneself(self):
        shown = timings([outcome("a", [1e-6, 1e-6]), outcome("b", [2e-6, 2e-6])], "us", {"b": "of b"})
        self.assertIn("| a | 1 (1 to 1) | 0.5 (0.5 to 0.5) |", shown)
        self.assertIn("| b | 2 (2 to 2) |  |", shown)

    def test_targets_and_sections_of_a_page(self):
        field = [
            outcome(name, [seconds] * 3)
            for name, seconds in (
                (evaluate.F32, 5e-6),
                (evaluate.ORT, 1e-5),
                (evaluate.LIMIT, 4e-6),
                (evaluate.CALL, 1e-6),
            )
        ]
        scene = [
            outcome(step.BARE, [1e-6]),
            outcome(step.FLUID, [2e-6]),
            outcome(f"{evaluate.F32}, {step.RELEASED}", [3e-6]),
        ]
        losses = [
            outcome(name, [seconds], values=[2.0, 1.0])
            for name, seconds in ((train.OURS, 0.5), (train.HAND, 1.0), (train.ONE, 1.5), (train.DIFFEQ, 2.0))
        ]
        machine = {
            "cpu": "some",
            "family": "1/2",
            "cores": 2,
            "virtual": True,
            "vectors": "AVX2",
            "caches": {"L2": "1M"},
            "memory_gib": 8.0,
            "kernel": "6",
            "rustc": "1",
            "python": "3",
            "packages": {"numpy": "2"},
        }
        groups = {
            "evaluate": {"field": field, "cold": field, "sample": field},
            "step": {"euler": scene},
            "train": {"euler": losses},
        }
        records = {
            part: {"groups": own, "machine": machine, "commit": "abc", "date": "today", "others": 0.05, "quick": False}
            for part, own in groups.items()
        }
        text = page(records)
        for line in (
            "| one evaluation, f32, of ONNX Runtime | at most 0.65 | 0.5 | met |",
            "| one evaluation, f32, of the bandwidth limit | at most 1.3 | 1.25 | met |",
            f"| a step under Euler, {evaluate.F32}, {step.RELEASED}, of the ellipsoid fluid | at most 1.3 | 1.5 | **missed** |",
            "| a training step, Euler, of PyTorch, loop by hand | at most 0.6 | 0.5 | met |",
            "| evaluate | abc | today | 5 % | full |",
        ):
            self.assertIn(line, text)
        self.assertEqual(text.count(machine["cpu"]), 1)
        self.assertNotIn("## Scaling", text)
        self.assertIn("PyTorch's, Euler, mean of the last 2 of 2 steps | at most 0.01 | 0 | met |", text)
        # On a busy machine times say nothing of a target; what was computed still does.
        text = page({part: each | {"others": 0.5} for part, each in records.items()})
        self.assertIn("| one evaluation, f32, of ONNX Runtime | at most 0.65 | 0.5 | machine too busy to say |", text)
        self.assertIn("PyTorch's, Euler, mean of the last 2 of 2 steps | at most 0.01 | 0 | met |", text)

    def test_every_part_has_its_three_functions(self):
        for module in PARTS.values():
            self.assertTrue(module.TITLE and module.measure and module.render and module.targets)

    def test_an_outcome_that_is_not_there(self):
        self.assertIsNone(named([outcome("a", [1.0])], "b"))


if __name__ == "__main__":
    unittest.main()

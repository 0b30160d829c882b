"""Both readings of the paper's attention: what `hydro train` makes against numpy and PyTorch, which share no code with it."""

import json
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file

from hydro_mujoco.jobs.here import Here
from hydro_mujoco_entry import find_program
from hydro_tools.benchmarks import networks
from hydro_tools.datasets import dataset, task2

KINDS = {
    "features": ["--tokens", "features", "--latent", "6", "--encoding", "raw", "--without-skip"],
    "features-end": ["--tokens", "features", "--window", "2", "--encoding", "up", "--end-of-step"],
    "samples-end": ["--window", "3", "--encoding", "up", "--end-of-step"],
    "samples": ["--window", "3", "--encoding", "raw"],
}
SIZES = ["--embedding", "16", "--hidden", "24,24", "--epochs", "1", "--batch", "2", "--horizon", "10", "--seed", "1"]


class Tokens(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = Path(cls.temporary.name)
        settings = dataset.Settings("t", 6, 5, 30, (0.4, 0.3, 0.3), 6, "mjcf/b1_truth.xml")
        original, task2.PILOT = task2.PILOT, 2
        cls.addClassCleanup(setattr, task2, "PILOT", original)
        dataset.generate(settings, cls.folder / "data", executor=Here())
        (shard,) = (cls.folder / "data").glob("test-*.safetensors")
        cls.test = load_file(shard)
        for name, flags in KINDS.items():
            out = ["--data", str(cls.folder / "data"), "--out", str(cls.folder / name)]
            cls.hydro("train", *out, *SIZES, *flags)

    @classmethod
    def hydro(cls, *arguments):
        run = subprocess.run([str(find_program()), *arguments], capture_output=True, text=True)
        if run.returncode:
            raise AssertionError(run.stderr)
        return run.stdout

    def evaluated(self, name, engine):
        flags = ["--data", str(self.folder / "data"), "--checkpoint", str(self.folder / name), "--engine", engine]
        return json.loads(self.hydro("evaluate", "--json", *flags))

    def errors(self, predict):
        """RMSE of each axis over all samples but the first, which is given."""
        x, clean = self.test["x"].astype(float), self.test["wrench_clean"].astype(float)
        found = np.stack([predict(*pair) for pair in zip(x, clean[:, 0])])
        return np.sqrt(np.mean((found - clean)[:, 1:] ** 2, axis=(0, 1)))

    def test_engine_and_candle_agree_with_numpy(self):
        for name in KINDS:
            wanted = self.errors(lambda x, start: networks.trajectory(self.folder / name, x, start))
            for engine in ("fused", "candle"):
                found = self.evaluated(name, engine)["errors"]["rmse"]
                np.testing.assert_allclose(found, wanted, rtol=2e-4, err_msg=f"{name}, {engine}")

    def test_engine_agrees_with_pytorch(self):
        try:
            import torch
            from safetensors.torch import load_file as load_torch
        except ImportError:
            self.skipTest("no torch: pip install -e scripts[bench]")
        from hydro_tools.benchmarks.implementations.model import AttentionOde

        for name in KINDS:
            card, _ = networks.read(self.folder / name)
            config, norm = card["config"], card["normaliser"]
            mean, std = np.array(norm["output_mean"]), np.array(norm["output_std"])
            z = networks.encode(card, self.test["x"].astype(float))
            padded = np.concatenate([np.repeat(z[:, :1], config["window"] - 1, 1), z], 1)
            model = AttentionOde(config, z.shape[-1], len(mean))
            model.load(load_torch(self.folder / name / "weights.safetensors"))
            start = (self.test["wrench_clean"][:, 0] - mean) / std
            with torch.inference_mode():
                h = model.latents(torch.from_numpy(padded).float())
                h = h[:, 1:] if config.get("end_of_step") else h[:, :-1]
                forces = mean + std * model.integrate(h, torch.from_numpy(start).float(), "euler").numpy()
            wanted = np.sqrt(np.mean((forces - self.test["wrench_clean"])[:, 1:] ** 2, axis=(0, 1)))
            np.testing.assert_allclose(self.evaluated(name, "fused")["errors"]["rmse"], wanted, rtol=2e-4, err_msg=name)

    def test_a_card_says_its_tokens_and_an_old_one_need_not(self):
        cards = {name: networks.read(self.folder / name)[0]["config"] for name in KINDS}
        self.assertEqual(cards["features"]["tokens"], "features")
        self.assertTrue(cards["features-end"]["end_of_step"])
        self.assertFalse({"tokens", "end_of_step"} & set(cards["samples"]))

    def test_what_is_known_without_learning_stands_beside_an_evaluation(self):
        rows = {row["name"]: row for row in self.evaluated("samples", "fused")["yardsticks"]}
        buoyancy = self.errors(lambda x, start: self.buoyancy_of(x))
        np.testing.assert_allclose(rows["exact buoyancy alone (no learning)"]["rmse"], buoyancy, rtol=1e-6)
        held = self.errors(lambda x, start: np.tile(start, (len(x), 1)))
        np.testing.assert_allclose(rows["the first force, held (no learning)"]["rmse"], held, rtol=1e-6)

    def buoyancy_of(self, x):
        (index,) = np.flatnonzero((self.test["x"].astype(float) == x).all(axis=(1, 2)))
        return self.test["hydrostatic"][index].astype(float)

    def test_tables_have_yardsticks_and_the_papers_numbers(self):
        flags = ["--data", str(self.folder / "data"), "--out", str(self.folder / "compare"), "--seeds", "1"]
        rows = "attention-features-euler,attention-features-end,attention-ode-end"
        self.hydro("compare", "task2", *flags, "--entries", rows, "--tables")
        page = (self.folder / "compare" / "README.md").read_text(encoding="utf-8")
        (held,) = (line for line in page.splitlines() if line.startswith("| the first force, held"))
        wanted = self.errors(lambda x, start: np.tile(start, (len(x), 1)))
        self.assertIn(f"| {np.sqrt(np.mean(wanted**2)):.1f} |", held)
        open_loop, cost = (
            [line for line in page.splitlines() if line.startswith("| the paper prints: LSTM (80 ms)")][at]
            for at in (0, 1)
        )
        self.assertIn("| 16.3 | 43.9 |", open_loop)
        self.assertIn("| 828422 |", cost)

    def test_too_many_tokens_and_flags_of_others_are_refused(self):
        data = ["--data", str(self.folder / "data"), "--out", str(self.folder / "refused")]
        cases = (
            (["--tokens", "features", "--encoding", "links"], "expected 128 at most: choose encoding raw or up"),
            (["--model", "mlp", "--tokens", "features"], "--tokens is not used by the model mlp"),
            (["--model", "lstm", "--end-of-step"], "--end-of-step is not used by the model lstm"),
        )
        for flags, words in cases:
            run = subprocess.run([str(find_program()), "train", *data, *flags], capture_output=True, text=True)
            self.assertEqual(run.returncode, 1, run.stderr)
            self.assertIn(words, run.stderr)
            self.assertLessEqual(len(run.stderr.strip().splitlines()), 3)
            self.assertFalse((self.folder / "refused" / "card.json").exists())


if __name__ == "__main__":
    unittest.main()

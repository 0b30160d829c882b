"""PyTorch: one evaluation, one sample of the Attention-ODE, whole trajectories."""

import json
import time
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import load_file

from ..networks import encode
from ..worker import serve
from .model import AttentionOde, Field
from .samples import OneSample
from .training_case import TrainingCase


def _rows(inputs: str) -> np.ndarray:
    return load_file(inputs)["x"].numpy()


class Evaluate(OneSample):
    """A perceptron, one row at a time."""

    def __init__(self, *, checkpoint: str, inputs: str, threads: int, evict: int = 0):
        torch.set_num_threads(threads)
        card = json.loads((Path(checkpoint) / "card.json").read_text())
        widths = [len(card["features"]), *card["config"]["hidden"], len(card["outputs"])]
        self.field = Field(widths).load(load_file(Path(checkpoint) / "weights.safetensors")).eval()
        super().__init__(list(torch.from_numpy(_rows(inputs)).float()[:, None]), evict)

    @torch.inference_mode()
    def evaluate(self, row):
        return self.field(row)

    def check(self):
        return torch.cat([self.evaluate(row) for row in self.rows]).flatten().tolist()


class Step(OneSample):
    """A sample of the Attention-ODE: the window's attention anew, one step of the field. Encoding is not timed."""

    def __init__(self, *, checkpoint: str, inputs: str, threads: int):
        torch.set_num_threads(threads)
        self.card = json.loads((Path(checkpoint) / "card.json").read_text())
        z = encode(self.card, _rows(inputs).astype(float))
        self.model = AttentionOde(self.card["config"], z.shape[-1], len(self.card["outputs"]))
        self.model.load(load_file(Path(checkpoint) / "weights.safetensors")).eval()
        super().__init__(list(torch.from_numpy(z).float()[None, :, None].unbind(1)))
        self.restart()

    def restart(self):
        norm = self.card["normaliser"]
        self.mean, self.std = np.array(norm["output_mean"]), np.array(norm["output_std"])
        self.force = torch.from_numpy(-self.mean / self.std).float()[None]
        self.window = self.rows[0].repeat(1, self.card["config"]["window"], 1)

    @torch.inference_mode()
    def evaluate(self, row):
        self.window = torch.cat([self.window[:, 1:], row], 1)
        self.force = self.model.step(self.force, self.model.latents(self.window)[:, -1], "euler")
        return self.force

    def check(self):
        self.restart()
        forces = [self.mean + self.std * self.evaluate(row)[0].numpy() for row in self.rows]
        self.restart()
        return np.concatenate(forces).tolist()


class Trajectories:
    """Forces of `batch` whole trajectories, without gradients."""

    def __init__(self, *, training_case: dict, batch: int, threads: int):
        torch.set_num_threads(threads)
        self.training_case = TrainingCase(**training_case)
        chosen = [index % len(self.training_case.z) for index in range(batch)]
        self.batch = self.training_case.gather(chosen)

    @torch.inference_mode()
    def forward(self):
        z, start, _ = self.batch
        return self.training_case.model.integrate(self.training_case.model.latents(z), start, self.training_case.solver)

    def check(self):
        return self.forward()[0, -1].tolist()

    def block(self, count: int) -> dict:
        begin = time.perf_counter()
        for _ in range(count):
            self.forward()
        return {"seconds": time.perf_counter() - begin}


if __name__ == "__main__":
    serve({"evaluate": Evaluate, "step": Step, "trajectories": Trajectories})

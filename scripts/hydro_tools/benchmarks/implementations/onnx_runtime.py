"""ONNX Runtime on the CPU, through bound inputs and outputs: the least that a call from Python costs."""

from pathlib import Path

import numpy as np
import onnxruntime as ort
from safetensors.numpy import load_file

from ..networks import encode
from ..worker import serve
from . import graphs
from .samples import OneSample


class Bound:
    """A session whose inputs and outputs are numpy arrays that stay where they are."""

    def __init__(self, model: bytes, threads: int, inputs: dict[str, np.ndarray], outputs: dict[str, np.ndarray]):
        options = ort.SessionOptions()
        options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
        options.graph_optimization_level = ort.GraphOptimizationLevel.ORT_ENABLE_ALL
        self.session = ort.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        self.binding = self.session.io_binding()
        for bind, arrays in ((self.binding.bind_input, inputs), (self.binding.bind_output, outputs)):
            for name, array in arrays.items():
                bind(name, "cpu", 0, np.float32, array.shape, array.ctypes.data)

    def run(self) -> None:
        self.session.run_with_iobinding(self.binding)


class Evaluate(OneSample):
    """A perceptron, one row at a time."""

    def __init__(self, *, checkpoint: str, inputs: str, threads: int, evict: int = 0):
        model, n, f = graphs.perceptron(Path(checkpoint))
        self.x, self.y = np.zeros((1, n), np.float32), np.zeros((1, f), np.float32)
        self.bound = Bound(model, threads, {"x": self.x}, {"y": self.y})
        super().__init__(list(load_file(inputs)["x"].astype(np.float32)), evict)

    def evaluate(self, row):
        self.x[0] = row
        self.bound.run()

    def check(self):
        found = []
        for row in self.rows:
            self.evaluate(row)
            found += self.y[0].tolist()
        return found


class Nothing(Evaluate):
    """A graph without work: the cost of a call."""

    def __init__(self, *, inputs: str, threads: int):
        rows = load_file(inputs)["x"].astype(np.float32)
        self.x, self.y = np.zeros((1, rows.shape[1]), np.float32), np.zeros((1, rows.shape[1]), np.float32)
        self.bound = Bound(graphs.nothing(rows.shape[1]), threads, {"x": self.x}, {"y": self.y})
        OneSample.__init__(self, list(rows))


class Step(OneSample):
    """A sample of the Attention-ODE: the window's attention anew, one step of the field. Encoding is not timed."""

    def __init__(self, *, checkpoint: str, inputs: str, threads: int):
        model, self.card, n, f = graphs.euler_sample(Path(checkpoint))
        z = encode(self.card, load_file(inputs)["x"].astype(float)).astype(np.float32)
        self.z, self.force = np.zeros((self.card["config"]["window"], n), np.float32), np.zeros((1, f), np.float32)
        self.after = np.zeros((1, f), np.float32)
        self.bound = Bound(model, threads, {"z": self.z, "force": self.force}, {"next": self.after})
        super().__init__(list(z))
        self.restart()

    def restart(self):
        norm = self.card["normaliser"]
        self.mean, self.std = np.array(norm["output_mean"]), np.array(norm["output_std"])
        self.force[0], self.z[:] = -self.mean / self.std, self.rows[0]

    def evaluate(self, row):
        self.z[:-1] = self.z[1:]
        self.z[-1] = row
        self.bound.run()
        self.force[:] = self.after

    def check(self):
        self.restart()
        forces = []
        for row in self.rows:
            self.evaluate(row)
            forces.append(self.mean + self.std * self.force[0])
        self.restart()
        return np.concatenate(forces).tolist()


if __name__ == "__main__":
    serve({"evaluate": Evaluate, "step": Step, "nothing": Nothing})

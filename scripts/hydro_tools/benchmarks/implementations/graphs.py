"""The networks as ONNX graphs, node by node, without an exporter's leftovers."""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from ..networks import read

OPSET = 21


class Graph:
    """Nodes and constants as they are added; names are numbers."""

    def __init__(self):
        self.nodes, self.constants = [], []

    def constant(self, value, kind=np.float32) -> str:
        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(value, kind), name))
        return name

    def add(self, kind: str, *inputs: str, output: str | None = None, **attributes) -> str:
        name = output or f"n{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, list(inputs), [name], **attributes))
        return name

    def affine(self, x: str, weight, bias, output: str | None = None) -> str:
        """x W^T + b."""
        product = self.add("MatMul", x, self.constant(weight.T))
        return self.add("Add", product, self.constant(bias), output=output)

    def field(self, x: str, weights: dict, output: str | None = None) -> str:
        """Linear layers with SiLU between them."""
        index = 0
        while f"field.{index}.weight" in weights:
            last = f"field.{index + 1}.weight" not in weights
            if index:
                x = self.add("Mul", x, self.add("Sigmoid", x))
            x = self.affine(
                x, weights[f"field.{index}.weight"], weights[f"field.{index}.bias"], output if last else None
            )
            index += 1
        return x

    def bytes(self, inputs: dict[str, list[int]], outputs: dict[str, list[int]]) -> bytes:
        """The model."""

        def values(shapes):
            return [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in shapes.items()]

        graph = helper.make_graph(self.nodes, "hydro", values(inputs), values(outputs), self.constants)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=10)
        onnx.checker.check_model(model)
        return model.SerializeToString()


def perceptron(checkpoint) -> tuple[bytes, int, int]:
    """x [1, n] -> y [1, f], with n and f."""
    card, weights = read(checkpoint)
    graph, inputs, outputs = Graph(), len(card["features"]), len(card["outputs"])
    graph.field("x", weights, output="y")
    return graph.bytes({"x": [1, inputs]}, {"y": [1, outputs]}), inputs, outputs


def nothing(inputs: int) -> bytes:
    """x [1, n] -> x: what a call costs by itself."""
    graph = Graph()
    graph.add("Identity", "x", output="y")
    return graph.bytes({"x": [1, inputs]}, {"y": [1, inputs]})


def euler_sample(checkpoint) -> tuple[bytes, dict, int, int]:
    """Window z [W, n] and force [1, f], standardised -> the next force [1, f]; with the card, n and f."""
    card, weights = read(checkpoint)
    config, outputs = card["config"], len(card["outputs"])
    window, heads, width = config["window"], config["heads"], config["embedding"]
    depth, inputs = width // heads, weights["embed.weight"].shape[1]
    graph = Graph()

    def affine(name, x):
        return graph.affine(x, weights[f"{name}.weight"], weights[f"{name}.bias"])

    def split(x, rows):
        """[rows, E] -> [H, rows, d]"""
        shaped = graph.add("Reshape", x, graph.constant([rows, heads, depth], np.int64))
        return graph.add("Transpose", shaped, perm=[1, 0, 2])

    def columns(x, index):
        begin, end, axis = (graph.constant([value], np.int64) for value in (index * width, (index + 1) * width, 1))
        return graph.add("Slice", x, begin, end, axis)

    last = graph.constant([window - 1], np.int64)
    end, rows = graph.constant([window], np.int64), graph.constant([0], np.int64)
    embeddings = affine("embed", "z")
    newest = graph.add("Slice", embeddings, last, end, rows)
    qkv = affine("attention.qkv", embeddings)
    query = split(graph.add("Slice", columns(qkv, 0), last, end, rows), 1)
    key, value = split(columns(qkv, 1), window), split(columns(qkv, 2), window)
    scores = graph.add("MatMul", query, graph.add("Transpose", key, perm=[0, 2, 1]))
    scores = graph.add("Mul", scores, graph.constant(depth**-0.5))
    bias = weights["attention.lag_bias"] - 4.0 ** (1 - np.arange(heads))[:, None] * np.arange(window)
    scores = graph.add("Add", scores, graph.constant(bias[:, None, ::-1]))
    attended = graph.add("MatMul", graph.add("Softmax", scores, axis=-1), value)
    attended = graph.add("Reshape", attended, graph.constant([1, width], np.int64))
    latent = affine("latent", graph.add("Add", newest, affine("mix", attended)))
    x = graph.add("Concat", "force", latent, axis=1)
    change = graph.field(x, weights)
    if "field.skip.weight" in weights:
        skip = weights["field.skip.weight"] - np.eye(outputs, weights["field.skip.weight"].shape[1])
        change = graph.add("Add", change, graph.add("MatMul", x, graph.constant(skip.T)))
    graph.add("Add", "force", change, output="next")
    return graph.bytes({"z": [window, inputs], "force": [1, outputs]}, {"next": [1, outputs]}), card, inputs, outputs

"""One evaluation: the field 12-512-512-512-6 alone, and a whole sample of the released Attention-ODE."""

from pathlib import Path

import numpy as np
from safetensors.numpy import load_file

from ...repository import ROOT
from .. import WORK, commands, data, networks, weights
from ..accuracy import axis_error
from ..alternation import Entry, run
from ..engines import CANDLE, ENGINES, F16, F32, I16
from ..markdown import named, timings
from ..spread import ratio
from ..target import Target

TITLE = "Single evaluation"
WIDTHS = [12, 512, 512, 512, 6]
RELEASED = ROOT / "models/b1-task2"
ORT, LIMIT, HALF_LIMIT, CALL = (
    "ONNX Runtime, 1 thread",
    "bandwidth limit",
    "bandwidth limit, f16",
    "ONNX Runtime, empty graph",
)
#: Numbers read between evaluations, 64 MiB: the weights then come from memory.
EVICTED = 16 << 20


def weight_bytes(widths: list[int]) -> int:
    """Bytes of a perceptron's weights in f32."""
    return 4 * sum((a + 1) * b for a, b in zip(widths, widths[1:]))


def ours(checkpoint: Path, inputs: Path, count: int, evict: int = 0) -> list[Entry]:
    """Our engines on a checkpoint."""
    task = {"kind": "engine", "checkpoint": str(checkpoint), "inputs": str(inputs), "evict": evict}
    return [
        Entry(name, [*commands.rust()], task | {"engine": engine}, count, tolerance=tolerance)
        for engine, (name, tolerance) in ENGINES.items()
    ]


def _candle(checkpoint: Path, inputs: Path, count: int) -> Entry:
    engine, name, tolerance = CANDLE
    task = {"kind": "engine", "checkpoint": str(checkpoint), "inputs": str(inputs), "engine": engine, "evict": 0}
    return Entry(name, [*commands.rust()], task, count, tolerance=tolerance)


def baseline(name: str, module: str, kind: str, count: int, threads: int = 1, **task) -> Entry:
    """One that is called from Python."""
    return Entry(name, commands.python(module), {"kind": kind, "threads": threads, **task}, count, threads=threads)


def read(name: str, count_of_bytes: int, count: int) -> Entry:
    """Reading as many bytes."""
    return Entry(name, [*commands.rust()], {"kind": "read", "bytes": count_of_bytes}, count, tolerance=None)


def expected(checkpoint: Path, inputs: Path) -> list[float]:
    """The forces in double precision."""
    return networks.walk(checkpoint, load_file(inputs)["x"].astype(float)).flatten().tolist()


def _run(entries: list[Entry], rounds: int, checkpoint: Path, inputs: Path, axes: int) -> list[dict]:
    """The outcomes, with the error in standard deviations in place of the numbers themselves."""
    wanted = expected(checkpoint, inputs)
    outcomes = run(entries, rounds, expected=wanted)
    for outcome in outcomes:
        found = outcome.pop("check")
        outcome["error"] = axis_error(found, wanted, axes) if len(found) == len(wanted) else None
    return outcomes


def measure(settings) -> dict:
    """Time every implementation; outcomes by group."""
    field, x = weights.bare_field(WORK / "field-512", WIDTHS, seed=0), data.drawn(WIDTHS[0])
    files = {"checkpoint": str(field), "inputs": str(x)}
    rounds, count = settings.pick(60, 6), settings.pick(400, 200)
    size = weight_bytes(WIDTHS)
    print("field, warm")
    warm = [
        *ours(field, x, count),
        _candle(field, x, count),
        Entry("Candle, linear layers", [*commands.rust()], {"kind": "plain-field", **files}, count),
        baseline(ORT, "onnx_runtime", "evaluate", count, **files),
        baseline("ONNX Runtime, 2 threads", "onnx_runtime", "evaluate", count, 2, **files),
        baseline("PyTorch, 1 thread", "pytorch", "evaluate", count, **files),
        baseline("PyTorch, 2 threads", "pytorch", "evaluate", count, 2, **files),
        read(LIMIT, size, count),
        read(HALF_LIMIT, size // 2, count),
        Entry(
            CALL,
            commands.python("onnx_runtime"),
            {"kind": "nothing", "inputs": str(x), "threads": 1},
            count,
            tolerance=None,
        ),
    ]
    groups = {"field": _run(warm, rounds, field, x, WIDTHS[-1])}

    print("field, weights pushed out of the caches")
    cold = [*ours(field, x, 20, EVICTED), baseline(ORT, "onnx_runtime", "evaluate", 20, **files, evict=EVICTED)]
    groups["cold"] = _run(cold, settings.pick(20, 3), field, x, WIDTHS[-1])

    print("one sample of the released model")
    samples = data.recorded()
    files = {"checkpoint": str(RELEASED), "inputs": str(samples)}
    whole = [
        *ours(RELEASED, samples, count),
        _candle(RELEASED, samples, count),
        baseline(ORT, "onnx_runtime", "step", count, **files),
        baseline("PyTorch, 1 thread", "pytorch", "step", count, **files),
    ]
    groups["sample"] = _run(whole, settings.pick(40, 4), RELEASED, samples, 6)
    return groups


def _error(outcome: dict) -> str:
    return "" if outcome["error"] is None else f"{outcome['error']:.1e}"


def without_call(outcomes: list[dict]) -> list[float]:
    """ONNX Runtime's time less that of a call with an empty graph, round by round."""
    return list(np.subtract(named(outcomes, ORT)["seconds"], named(outcomes, CALL)["seconds"]))


def render(groups: dict) -> str:
    """The section of the page, in Markdown."""
    field = groups["field"]
    inner = ratio(named(field, F32)["seconds"], without_call(field))
    return "\n".join(
        [
            "The field 12-512-512-512-6 with SiLU, f32, one row, the same random weights for all (535 k numbers, "
            f"{weight_bytes(WIDTHS) / 2**20:.1f} MiB). All weights stay where the caches keep them from one evaluation to the next, "
            "as in a simulation. The bandwidth limit is one core reading as many bytes. ONNX Runtime is called from Python with "
            "bound arrays; the empty graph shows what such a call costs by itself: without it, our f32 takes "
            f"{inner.median:.2f} ({inner.low:.2f} to {inner.high:.2f}) of its time. Error: worst axis, root mean square in standard "
            "deviations of the output, against double precision.\n",
            timings(field, "us", {ORT: "of ONNX Runtime", LIMIT: "of the limit"}, {"error": _error}),
            "With 64 MiB read between evaluations, so that the weights come from memory:\n",
            timings(groups["cold"], "us", {ORT: "of ONNX Runtime"}),
            "A whole sample of the released model (35 features, window 8, 256-256-256), as the plugin takes it. Ours begins with the "
            "raw features; the others are given encoded and standardised inputs, and attend to the whole window anew.\n",
            timings(groups["sample"], "us", {ORT: "of ONNX Runtime"}, {"error": _error}),
        ]
    )


def targets(groups: dict) -> list[Target]:
    """The figures that have a target."""
    field = groups["field"]

    def median_ratio(name, other):
        return ratio(named(field, name)["seconds"], named(field, other)["seconds"]).median

    found = [
        Target("one evaluation, f32, of ONNX Runtime", median_ratio(F32, ORT), 0.65),
        Target("one evaluation, f32, of the bandwidth limit", median_ratio(F32, LIMIT), 1.3),
    ]
    for name, short, most in ((F16, "f16", 0.45), (I16, "int16", 0.40)):
        if named(field, name):
            error = named(groups["sample"], name)["error"]
            found += [
                Target(f"one evaluation, {short}, of ONNX Runtime", median_ratio(name, ORT), most),
                Target(f"wrench error of {short}, released model [standard deviations]", error, 0.005),
            ]
    return found

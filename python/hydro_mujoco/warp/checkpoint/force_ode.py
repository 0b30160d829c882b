"""The MLP-ODE and the Attention-ODE in MuJoCo Warp (crates/model/src/architectures/force_ode.rs)."""

from typing import Protocol

import numpy as np
import warp as wp

from .card import Card
from .kernels.attending import attend
from .kernels.relaxing import push
from .kernels.stepping import (
    SETTLING_STEPS,
    accumulate,
    begin,
    begin_to_settle,
    clear,
    finish,
    settle_on,
    stage,
    to_si,
)
from .lanes import LANES, Lanes
from .perceptron import Perceptron, Product
from .sampling import Sampling

#: Factor of the slope before in each stage, and weight of its own: one step a sample.
TABLEAUX = {"euler": ((0.0, 1.0),), "rk4": ((0.0, 1 / 6), (0.5, 1 / 3), (0.5, 1 / 3), (1.0, 1 / 6))}


class Latent(Protocol):
    """What drives the field beside the force."""

    def launch(self, h: wp.array) -> None:
        """h, shape (groups, latent), of the samples that are due."""


class PerceptronLatent:
    """A perceptron of the newest sample."""

    def __init__(self, card: Card, sampling: Sampling):
        self._s = sampling
        self._layers = Perceptron(card.weights, "latent", sampling.groups, sampling.device)

    def launch(self, h: wp.array) -> None:
        """h of the samples that are due."""
        self._layers.launch(self._s.due, self._s.z.groups, h)


class AttentionLatent:
    """Attention of the newest sample over a window, its weights folded: samples are keys and values themselves."""

    def __init__(self, card: Card, sampling: Sampling):
        self._s = s = sampling
        heads, n = card.config["heads"], s.inputs
        query, query_bias, output, output_bias = folded(card)
        self._query = Product(query, query_bias, s.device)
        self._output = Product(output, output_bias, s.device)
        window = card.config["window"]
        slopes = 4.0 ** (1 - np.arange(heads))
        lag_bias = card.weights["attention.lag_bias"] - np.outer(slopes, np.arange(window))
        self._lag_bias = wp.array(lag_bias, dtype=float, device=s.device)
        self._window = wp.zeros((s.groups, window, n), dtype=wp.vec4, device=s.device)
        self._scores = wp.zeros((s.groups, heads, window), dtype=wp.vec4, device=s.device)
        self._queries, self._seen = s.lanes(heads * n), s.lanes((1 + heads) * n)

    def launch(self, h: wp.array) -> None:
        """h of the samples that are due."""
        s = self._s
        due, z = s.due.groups, s.z.groups
        wp.launch(push, dim=z.shape, inputs=[s.starts.groups, due, z], outputs=[self._window], device=s.device)
        self._query.launch(s.due, z, self._queries.groups)
        seen = self._seen.groups
        wp.launch(
            attend,
            dim=self._scores.shape[:2],
            inputs=[due, self._window, self._queries.groups, self._lag_bias],
            outputs=[self._scores, seen],
            device=s.device,
        )
        self._output.launch(s.due, seen, h)


def folded(card: Card) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Matrix and offset of the queries of all heads, of a sample z_0; and of h, of z_0 and the means of the heads.

    Source: crates/model/src/engine/attention_cache.rs.
    """
    w, heads = card.weights, card.config["heads"]
    embed, embed_bias = w["embed.weight"], w["embed.bias"]
    mix, latent = w["mix.weight"], w["latent.weight"]
    width = len(embed_bias)
    depth = width // heads
    parts = w["attention.qkv.weight"].reshape(3, heads, depth, width)
    offsets = w["attention.qkv.bias"].reshape(3, heads, depth)
    query, query_bias, output = [], [], [latent @ embed]
    output_bias = latent @ (embed_bias + w["mix.bias"]) + w["latent.bias"]
    for head in range(heads):
        keys = (parts[1, head] @ embed).T / np.sqrt(depth)
        query.append(keys @ parts[0, head] @ embed)
        query_bias.append(keys @ (parts[0, head] @ embed_bias + offsets[0, head]))
        values = latent @ mix[:, head * depth : (head + 1) * depth]
        output.append(values @ parts[2, head] @ embed)
        output_bias = output_bias + values @ (parts[2, head] @ embed_bias + offsets[2, head])
    return np.vstack(query), np.concatenate(query_bias), np.hstack(output), output_bias


class ForceOde:
    """A force that a field steps from sample to sample."""

    predicts_next = True

    def __init__(self, card: Card, sampling: Sampling):
        self._s = s = sampling
        config = card.config
        self._latent: Latent = (AttentionLatent if card.kind == "attention-ode" else PerceptronLatent)(card, s)
        self._sees = bool(config["field_sees_force"])
        self._at_end = bool(config.get("end_of_step", False))
        # A field that does not read the force has a constant slope.
        self._tableau = TABLEAUX[card.solver if self._sees else "euler"]
        self._field = Perceptron(card.weights, "field", s.groups, s.device, is_relaxing=self._sees)
        self._input = s.lanes(self._field.inputs)
        self._force, self._slope, self._change = (s.lanes(s.outputs) for _ in range(3))
        self._settling = s.lanes(1)
        self._steps = wp.zeros(s.groups * LANES, dtype=int, device=s.device)
        self._is_any = wp.zeros(1, dtype=int, device=s.device)

    def observe(self) -> None:
        """Take the samples that are due."""
        s = self._s
        sees = s.outputs if self._sees else 0
        self._latent.launch(self._input.groups[:, sees:])
        starts, due, units = s.starts.groups, s.due.groups, [s.mean, s.std]
        force, slope, change = self._force.groups, self._slope.groups, self._change.groups
        shape, device = (s.groups, s.outputs), s.device
        if not s.is_given:
            self._settle()
            wp.launch(to_si, dim=shape, inputs=[starts, force, *units], outputs=[s.first.groups], device=device)
        wp.launch(
            begin,
            dim=shape,
            inputs=[starts, due, s.first.groups, *units, s.least, s.most, s.next.groups],
            outputs=[s.now.groups, force, slope, change],
            device=device,
        )
        self._step(s.due)
        wp.launch(
            finish,
            dim=shape,
            inputs=[starts, due, force, change, *units, self._at_end],
            outputs=[s.now.groups, s.next.groups],
            device=device,
        )

    def _step(self, due: Lanes) -> None:
        """The change of the force over a sample period."""
        s = self._s
        shape, slope, device = (s.groups, s.outputs), self._slope.groups, s.device
        for along, weight in self._tableau:
            if self._sees:
                inputs = [due.groups, self._force.groups, slope, along]
                wp.launch(stage, dim=shape, inputs=inputs, outputs=[self._input.groups], device=device)
            self._field.launch(due, self._input.groups, slope)
            inputs = [due.groups, slope, weight]
            wp.launch(accumulate, dim=shape, inputs=inputs, outputs=[self._change.groups], device=device)

    def _settle(self) -> None:
        """The force to which the first sample leads in the worlds that start, if it stays as it is."""
        s = self._s
        state = [self._force.numbers, self._slope.numbers, self._change.numbers, self._settling.numbers, self._steps]
        worlds = s.groups * LANES
        wp.launch(clear, dim=1, outputs=[self._is_any], device=s.device)
        wp.launch(
            begin_to_settle,
            dim=worlds,
            inputs=[s.starts.numbers],
            outputs=[*state, self._is_any],
            device=s.device,
        )

        def step() -> None:
            self._step(self._settling)
            wp.launch(clear, dim=1, outputs=[self._is_any], device=s.device)
            wp.launch(settle_on, dim=worlds, inputs=state, outputs=[self._is_any], device=s.device)

        if s.may_branch:
            wp.capture_while(self._is_any, while_body=step)
        else:
            for _ in range(SETTLING_STEPS):
                step()

"""PyTorch's training step: a loop by hand, torchdiffeq's odeint, torchdiffeq's continuous adjoint."""

import time

import torch
from torchdiffeq import odeint, odeint_adjoint

from ..worker import serve
from .model import AttentionOde
from .training_case import TrainingCase


def by_hand(model: AttentionOde, h, start, solver: str):
    """The loop that one writes."""
    return model.integrate(h, start, solver)


class Held(torch.nn.Module):
    """dF/dt for torchdiffeq: h is held over a step; `perturb` keeps a step's end on its own side of the sample."""

    def __init__(self, model: AttentionOde, h):
        super().__init__()
        self.model, self.h = model, h.unbind(1)

    def forward(self, t, force):
        index = min(max(int(t), 0), len(self.h) - 1)
        return self.model.slope(force, self.h[index])


def torchdiffeq(model: AttentionOde, h, start, solver: str):
    """On the sample grid. Its rk4 is Kutta's 3/8 rule, of the same order and cost."""
    times = torch.arange(h.shape[1] + 1, dtype=torch.float32)
    forces = odeint(Held(model, h), start, times, method=solver, options={"perturb": True})
    return forces.transpose(0, 1)


class HeldFlat(torch.nn.Module):
    """As `Held`, with h as one tensor, so that the adjoint differentiates by it."""

    def __init__(self, model: AttentionOde, h):
        super().__init__()
        self.model, self.h = model, h

    def forward(self, t, force):
        index = min(max(int(t), 0), self.h.shape[1] - 1)
        return self.model.slope(force, self.h[:, index])


def continuous_adjoint(model: AttentionOde, h, start, solver: str):
    """Backward solves another ODE: no activations are kept, and the gradient is not the discrete one's."""
    times = torch.arange(h.shape[1] + 1, dtype=torch.float32)
    wanted = list(model.field.parameters()) + ([h] if h.requires_grad else [])
    forces = odeint_adjoint(
        HeldFlat(model, h), start, times, method=solver, options={"perturb": True}, adjoint_params=tuple(wanted)
    )
    return forces.transpose(0, 1)


class Training:
    """Steps of the optimiser by one of the ways above."""

    WAYS = {"by hand": by_hand, "torchdiffeq": torchdiffeq, "continuous adjoint": continuous_adjoint}

    def __init__(self, *, training_case: dict, way: str, threads: int):
        torch.set_num_threads(threads)
        self.training_case, self.integrate = TrainingCase(**training_case), self.WAYS[way]

    def check(self):
        return self.training_case.first(self.integrate)

    def block(self, count: int) -> dict:
        begin = time.perf_counter()
        values = [self.training_case.learn(self.integrate) for _ in range(count)]
        return {"seconds": time.perf_counter() - begin, "values": values}


if __name__ == "__main__":
    serve({"training": Training})

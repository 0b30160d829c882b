"""A training case: standardised trajectories, their order, the first weights; the Rust side reads the same."""

import torch
from safetensors.torch import load_file

from .model import AttentionOde


class TrainingCase:
    """A model with its data and the optimiser's settings."""

    def __init__(
        self,
        *,
        data: str,
        weights: str,
        model: dict,
        solver: str,
        field_alone: bool,
        learning_rate: float,
        weight_decay: float,
        clip_norm: float,
    ):
        tensors = load_file(data)
        self.z, self.target, self.order = tensors["z"], tensors["target"], tensors["order"].long()
        self.config, self.solver, self.field_alone, self.clip_norm = model, solver, field_alone, clip_norm
        self.model = AttentionOde(model, self.z.shape[-1], self.target.shape[-1]).load(load_file(weights))
        named = list(self.model.named_parameters())
        groups = [
            {"params": [p for _, p in named if p.dim() > 1], "weight_decay": weight_decay},
            {"params": [p for _, p in named if p.dim() <= 1], "weight_decay": 0.0},
        ]
        self.optimiser = torch.optim.AdamW(groups, lr=learning_rate, betas=(0.9, 0.99), eps=1e-8)
        self.steps = 0

    def gather(self, chosen):
        """z [B, W-1+S, n] (h [B, S, l] where the field is alone), F_0 [B, f], target [B, S+1, f]."""
        z, target = self.z[chosen][:, :-1], self.target[chosen]
        if self.field_alone:
            return z[..., : self.config["latent"]].contiguous(), target[:, 0], target
        past = z[:, :1].expand(-1, self.config["window"] - 1, -1)
        return torch.cat([past, z], 1), target[:, 0], target

    def batch(self, step: int):
        """The trajectories of a step; after the last step the first comes again."""
        return self.gather(self.order[step % len(self.order)])

    def loss(self, step: int, integrate):
        """Mean squared error by one way to integrate."""
        z, start, target = self.batch(step)
        h = z if self.field_alone else self.model.latents(z)
        return torch.nn.functional.mse_loss(integrate(self.model, h, start, self.solver), target)

    def first(self, integrate) -> list[float]:
        """Loss and gradient norm at the present weights, unchanged."""
        loss = self.loss(0, integrate)
        loss.backward()
        square = sum(float(p.grad.double().square().sum()) for p in self.model.parameters() if p.grad is not None)
        self.optimiser.zero_grad()
        return [loss.item(), square**0.5]

    def learn(self, integrate) -> float:
        """One step of the optimiser; the loss before it."""
        self.optimiser.zero_grad()
        loss = self.loss(self.steps, integrate)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), self.clip_norm)
        self.optimiser.step()
        self.steps += 1
        return loss.item()

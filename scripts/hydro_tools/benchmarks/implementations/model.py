"""The Attention-ODE as a user of PyTorch writes it; weights by the names of a checkpoint."""

import torch
from torch import nn
from torch.nn import functional as F

STAGES = {"euler": 1, "rk4": 4}


class Field(nn.Module):
    """Linear layers with SiLU between them."""

    def __init__(self, widths: list[int]):
        super().__init__()
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in zip(widths, widths[1:]))

    def forward(self, x):
        for layer in self.layers[:-1]:
            x = F.silu(layer(x))
        return self.layers[-1](x)

    def load(self, tensors: dict) -> "Field":
        """Weights `field.0.weight` ..."""
        for index, layer in enumerate(self.layers):
            layer.weight.data, layer.bias.data = tensors[f"field.{index}.weight"], tensors[f"field.{index}.bias"]
        return self


class AttentionOde(nn.Module):
    """z [B, W-1+S, n], F_0 [B, f] -> F [B, S+1, f]; all standardised."""

    def __init__(self, config: dict, inputs: int, outputs: int):
        super().__init__()
        self.config, width = config, config["embedding"]
        self.over_features = config.get("tokens") == "features"
        count = config["window"] * inputs
        self.embed = nn.Linear(inputs, width)
        self.token_weight = nn.Parameter(torch.empty(count, width).uniform_(-(3**0.5), 3**0.5))
        self.token_bias = nn.Parameter(torch.empty(count, width).uniform_(-1, 1))
        self.qkv = nn.Linear(width, 3 * width)
        self.lag_bias = nn.Parameter(torch.zeros(config["heads"], config["window"]))
        self.mix = nn.Linear(width, width)
        self.latent = nn.Linear(width, config["latent"])
        self.field = Field([outputs + config["latent"], *config["hidden"], outputs])
        self.skip = nn.Linear(outputs + config["latent"], outputs, bias=False) if config["skip"] else None
        slope = 4.0 ** (1 - torch.arange(config["heads"]))
        self.register_buffer("slopes", slope[:, None] * torch.arange(config["window"]))

    def load(self, tensors: dict) -> "AttentionOde":
        layers = [("attention.qkv", self.qkv), ("mix", self.mix), ("latent", self.latent)]
        if self.over_features:
            self.token_weight.data, self.token_bias.data = tensors["tokens.weight"], tensors["tokens.bias"]
        else:
            layers.append(("embed", self.embed))
            self.lag_bias.data = tensors["attention.lag_bias"]
        for name, layer in layers:
            layer.weight.data, layer.bias.data = tensors[f"{name}.weight"], tensors[f"{name}.bias"]
        self.field.load(tensors)
        if self.skip is not None:  # the field starts out as a relaxation: -1 on the diagonal
            learned = tensors["field.skip.weight"]
            self.skip.weight.data = learned - torch.eye(*learned.shape)
        return self

    def latents(self, z):
        """z [B, W-1+S, n] -> h [B, S, l]."""
        return self.latents_over_features(z) if self.over_features else self.latents_over_samples(z)

    def latents_over_features(self, z):
        """Attention among the numbers of a window, newest sample first; the mean of all tokens."""
        window, heads, width = (self.config[name] for name in ("window", "heads", "embedding"))
        # [B, S, n, W], oldest first.
        rows = z.unfold(1, window, 1).flip(-1).transpose(2, 3).flatten(2)
        tokens = rows[..., None] * self.token_weight + self.token_bias
        parts = self.qkv(tokens).unflatten(-1, (3, heads, width // heads)).unbind(-3)
        query, key, value = (part.transpose(-3, -2) for part in parts)
        attended = F.scaled_dot_product_attention(query, key, value).transpose(-3, -2).flatten(-2)
        return self.latent((tokens + self.mix(attended)).mean(-2))

    def latents_over_samples(self, z):
        """Attention of the newest sample over those of a window."""
        window, heads, width = (self.config[name] for name in ("window", "heads", "embedding"))
        batch, samples, _ = z.shape
        embeddings = self.embed(z)
        query, key, value = self.qkv(embeddings).view(batch, samples, 3, heads, width // heads).unbind(2)
        # [B, S, H, d, W], oldest first; the bias is by lag.
        keys, values = key.unfold(1, window, 1), value.unfold(1, window, 1)
        scores = torch.einsum("bshd,bshdw->bshw", query[:, window - 1 :], keys) / (width // heads) ** 0.5
        weights = torch.softmax(scores + (self.lag_bias - self.slopes).flip(-1), -1)
        attended = torch.einsum("bshw,bshdw->bshd", weights, values).flatten(2)
        return self.latent(embeddings[:, window - 1 :] + self.mix(attended))

    def slope(self, force, h):
        """dF/dt in sample periods."""
        x = torch.cat([force, h], -1)
        y = self.field(x)
        return y if self.skip is None else y + self.skip(x)

    def step(self, force, h, solver: str):
        """One sample on, h held."""
        first = self.slope(force, h)
        if solver == "euler":
            return force + first
        second = self.slope(force + 0.5 * first, h)
        third = self.slope(force + 0.5 * second, h)
        fourth = self.slope(force + third, h)
        return force + (first + 2 * (second + third) + fourth) / 6

    def integrate(self, h, start, solver: str):
        """h [B, S, l] -> F [B, S+1, f], step by step."""
        forces = [start]
        for latent in h.unbind(1):
            forces.append(self.step(forces[-1], latent, solver))
        return torch.stack(forces, 1)

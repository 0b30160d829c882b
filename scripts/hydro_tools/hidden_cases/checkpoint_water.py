"""The learned water of the free swimmer, evaluated in numpy from `card.json` and `weights.safetensors`.

Independent of the plugin's code: written from the architecture's equations. Samples stand every 10 ms; at
sample k the window of the last W samples gives a latent h_k, and F_{k+1} = F_k + field([F_k; h_k]) in
standard deviations; between samples the force is the line between the two. A run starts with a window
filled with its first sample and the force that the field settles to there. Where the card has the range of
its training (`envelope`), velocities and forces are held to it, and a base velocity that is d out of its range
meets a drag of the greatest force along it times s^2, and from s = 1 on times 2 s - 1, where s = d / h and 2 h is
the width of the widest range of its kind. Rest is in every range.
"""

import json
from pathlib import Path

import numpy as np

from .frames import rotation, turned_back

#: Samples a component may change less than, in settling, and how many steps it is given.
SETTLED, SETTLING = 1e-6, 200
#: Standardised inputs are held within this many deviations.
LIMIT = 20.0


class Checkpoint:
    """Weights and card of an Attention-ODE."""

    def __init__(self, folder: Path):
        from safetensors.numpy import load_file

        card = json.loads((folder / "card.json").read_text())
        config = card["config"]
        if card["kind"] != "attention-ode" or config["encoding"] != "up" or card["solver"] != "euler":
            raise ValueError(
                f"{folder}: expected an attention-ode with the up encoding and euler steps, "
                f"found {card['kind']}, {config['encoding']}, {card['solver']}"
            )
        w = {name: value.astype(float) for name, value in load_file(folder / "weights.safetensors").items()}
        self.window, self.heads, self.period = config["window"], config["heads"], card["sample_period"]
        self.joints = card["joints"]
        self.features = len(card["features"])
        self.mean, self.std = (np.array(card["normaliser"][f"input_{name}"]) for name in ("mean", "std"))
        self.out_mean, self.out_std = (np.array(card["normaliser"][f"output_{name}"]) for name in ("mean", "std"))
        self.embed = w["embed.weight"], w["embed.bias"]
        self.qkv = w["attention.qkv.weight"], w["attention.qkv.bias"]
        self.mix = w["mix.weight"], w["mix.bias"]
        self.latent = w["latent.weight"], w["latent.bias"]
        self.envelope = {name: np.array(values) for name, values in card.get("envelope", {}).items()}
        depth = len(config["hidden"]) + 1
        self.layers = [(w[f"field.{i}.weight"], w[f"field.{i}.bias"]) for i in range(depth)]
        skip = w["field.skip.weight"].copy()
        # The learned part of a linear map that starts out as a relaxation of the force.
        skip[:, :6] -= np.eye(6)
        self.skip = skip
        lags = np.arange(self.window)
        slope = 4.0 ** (1 - np.arange(self.heads))
        self.bias = w["attention.lag_bias"] - slope[:, None] * lags  # [heads, lag], lag 0 the newest

    def standardised(self, sample: np.ndarray) -> np.ndarray:
        """Encoded, standardised inputs [M, 34] of raw features [M, 35]: the quaternion gives way to `up`."""
        w, x, y, z = np.moveaxis(sample[:, 24:28], -1, 0)
        up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1)
        z = (np.concatenate([sample[:, :24], up, sample[:, 28:]], 1) - self.mean) / self.std
        return np.clip(z, -LIMIT, LIMIT)

    def held(self, sample: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Raw features [M, 35] with velocities in the range of the training, and the drag [M, 6] for what is not."""
        if not self.envelope:
            return sample, np.zeros((len(sample), 6))
        least, most = np.minimum(self.envelope["least"], 0), np.maximum(self.envelope["most"], 0)
        velocity = np.r_[12:24, 28:34]
        held = sample.copy()
        held[:, velocity] = np.clip(sample[:, velocity], least[velocity], most[velocity])
        along = np.r_[31:34, 28:31]
        half = (most - least)[along].reshape(2, 3) / 2
        half = half.max(1).repeat(3)
        s = (sample - held)[:, along] / half
        greatest = np.maximum(np.abs(self.envelope["least_force"]), np.abs(self.envelope["most_force"]))
        return held, -greatest * np.sign(s) * np.where(np.abs(s) < 1, s**2, 2 * np.abs(s) - 1)

    def held_force(self, force: np.ndarray) -> np.ndarray:
        """A force [M, 6] in standard deviations within the range of the training."""
        if not self.envelope:
            return force
        newtons = self.out_mean + self.out_std * force
        newtons = np.clip(newtons, self.envelope["least_force"], self.envelope["most_force"])
        return (newtons - self.out_mean) / self.out_std

    def embedded(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Embedding [M, E] and its queries, keys and values [M, 3 E]."""
        e = z @ self.embed[0].T + self.embed[1]
        return e, e @ self.qkv[0].T + self.qkv[1]

    def latent_of(self, newest: np.ndarray, qkv: np.ndarray) -> np.ndarray:
        """h [M, l] from the newest embedding [M, E] and the window's qkv [M, W, 3 E], oldest first."""
        m, w, _ = qkv.shape
        width = newest.shape[1]
        depth = width // self.heads
        q = qkv[:, -1, :width].reshape(m, self.heads, depth)
        k = qkv[:, :, width : 2 * width].reshape(m, w, self.heads, depth)
        v = qkv[:, :, 2 * width :].reshape(m, w, self.heads, depth)
        score = np.einsum("mhd,mwhd->mhw", q, k) / np.sqrt(depth) + self.bias[:, ::-1]
        score = np.exp(score - score.max(-1, keepdims=True))
        score /= score.sum(-1, keepdims=True)
        attended = np.einsum("mhw,mwhd->mhd", score, v).reshape(m, width)
        mixed = newest + attended @ self.mix[0].T + self.mix[1]
        return mixed @ self.latent[0].T + self.latent[1]

    def slope(self, force: np.ndarray, latent: np.ndarray) -> np.ndarray:
        """Change of the force over a sample [M, 6], in standard deviations."""
        x = np.concatenate([force, latent], 1)
        y = x
        for i, (weight, bias) in enumerate(self.layers):
            y = y @ weight.T + bias
            if i < len(self.layers) - 1:
                y = y / (1 + np.exp(-y))
        return y + x @ self.skip.T

    def settled(self, latent: np.ndarray) -> np.ndarray:
        """The force at rest under a held latent [M, 6], from the training mean."""
        force = np.zeros((len(latent), 6))
        moving = np.ones(len(latent), bool)
        for _ in range(SETTLING):
            change = self.slope(force, latent)
            force[moving] += change[moving]
            moving &= np.abs(change).max(1) >= SETTLED
            if not moving.any():
                break
        return force


class LearnedWater:
    """The checkpoint's force on one floating body of every member of a plant."""

    def __init__(self, checkpoint: Checkpoint, body: int, *, density: float = 1000.0):
        self.checkpoint, self.body, self.density = checkpoint, body, density
        self.keys: np.ndarray | None = None
        self.force = self.next = self.drag = np.zeros((0, 6))
        self.sign: np.ndarray | None = None
        self.ticks = 0

    def sample(self, plant) -> np.ndarray:
        """Raw features [M, 35] of the plant's state."""
        q = plant.qpos[:, 3:7]
        turn = rotation(q)
        velocity = turned_back(turn, plant.qvel[:, :3] - plant.current)
        return np.concatenate(
            [
                plant.qpos[:, 7:19],
                plant.qvel[:, 6:18],
                q,
                plant.qvel[:, 3:6],
                velocity,
                np.full((len(q), 1), self.density),
            ],
            1,
        )

    def apply(self, plant) -> None:
        """Add the wrench; take a sample where one is due."""
        per_sample = round(self.checkpoint.period / plant.step_length)
        if self.ticks % per_sample == 0:
            self._take(self.sample(plant))
        part = (self.ticks % per_sample) / per_sample
        self.ticks += 1
        normal = self.force * (1 - part) + self.next * part
        wrench = self.checkpoint.out_mean + self.checkpoint.out_std * normal + self.drag
        plant.add_wrench(self.body, wrench[:, :3], wrench[:, 3:])

    def _take(self, sample: np.ndarray) -> None:
        net = self.checkpoint
        sample, self.drag = net.held(sample)
        embedding, qkv = net.embedded(net.standardised(sample))
        if self.keys is None:
            self.keys = np.full((len(qkv), net.window, qkv.shape[1]), np.nan)
            self.next = np.full((len(qkv), 6), np.nan)
        cold = np.isnan(self.next[:, 0])
        self.keys = np.concatenate([self.keys[:, 1:], qkv[:, None]], 1)
        self.keys[cold] = qkv[cold, None]
        latent = net.latent_of(embedding, self.keys)
        self.force = self.next.copy()
        if cold.any():
            self.force[cold] = net.settled(latent[cold])
        self.force = net.held_force(self.force)
        self.next = net.held_force(self.force + net.slope(self.force, latent))

    def copy_members(self, members: np.ndarray) -> "LearnedWater":
        """Its memory just before a sample is due, of some members."""
        other = LearnedWater(self.checkpoint, self.body, density=self.density)
        other.ticks = self.ticks
        if self.keys is not None:
            other.keys, other.force, other.next = (a[members].copy() for a in (self.keys, self.force, self.next))
        return other

    @staticmethod
    def gathered(waters: list["LearnedWater"], which: list[int], members: np.ndarray) -> "LearnedWater":
        """One water whose member i is member `members[i]` of `waters[which[i]]`; fresh ones start cold."""
        first = waters[0]
        out = LearnedWater(first.checkpoint, first.body, density=first.density)
        warm = [w for w in waters if w.keys is not None]
        if not warm:
            return out
        shape = warm[0].keys.shape[1:]
        count = len(members)
        out.keys = np.empty((count, *shape))
        out.force, out.next = np.empty((count, 6)), np.empty((count, 6))
        for i, (w, member) in enumerate(zip(which, members)):
            source = waters[w]
            if source.keys is None:
                # A row of no numbers is a member that starts cold.
                out.keys[i], out.force[i], out.next[i] = np.nan, np.nan, np.nan
            else:
                out.keys[i], out.force[i], out.next[i] = source.keys[member], source.force[member], source.next[member]
        return out

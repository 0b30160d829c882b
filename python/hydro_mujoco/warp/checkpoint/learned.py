"""A checkpoint in the water of an instance, in many worlds."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

from ..arrays import Arrays
from ..rows import Water
from ..support import refuse
from .card import Card
from .cnode import Cnode
from .encoding import encoding
from .force_ode import ForceOde
from .kernels.act import act, hold
from .kernels.clock import take_samples
from .kernels.encode import Frames, encode
from .lstm import Lstm
from .mlp import Mlp
from .relaxation import Relaxation
from .robot import limits, places, reading
from .sampling import Network, Sampling
from .settings import Settings

#: Networks by the kind of their card.
NETWORKS: dict[str, Callable[[Card, Sampling], Network]] = {
    "relaxation-ode": Relaxation,
    "mlp-ode": ForceOde,
    "attention-ode": ForceOde,
    "lstm": Lstm,
    "cnode": Cnode,
    "mlp": Mlp,
}


@dataclass(frozen=True)
class Carrier:
    """Where a checkpoint acts.

    body: its number. water: number of the instance. row: of the body's water.
    """

    body: int
    water: int
    row: int


class Learned:
    """The force of a checkpoint: its clock and memory in each world, and its network."""

    def __init__(
        self, m: mjw.Model, model: mujoco.MjModel, settings: Settings, carrier: Carrier, where: str, nworld: int
    ):
        card, names, device = settings.card, settings.joints, m.dof_parentid.device
        _check_step(float(m.opt.timestep.numpy().max()), card.sample_period, where)

        def put(values: object, dtype: type) -> wp.array:
            return wp.array(np.array(values), dtype=dtype, device=device)

        self._nworld, self._device = nworld, device
        self._period = wp.float64(card.sample_period)
        self._reading = reading(model, card, names, body=carrier.body, density=settings.density, put=put)
        self._reading.row, self._reading.water = carrier.row, carrier.water
        self._limits = limits(card, put)
        self._places = places(model, card, names, settings.outputs, settings.wrench_scale, put)
        self._encoding = encoding(card, put)
        self._row = carrier.row
        self._sampling = s = Sampling(card, nworld, settings.initial_force, device)
        s.may_branch = device.is_cpu or bool(m.opt.graph_conditional)
        self._network = NETWORKS[card.kind](card, s)
        self._phase = wp.zeros(nworld, dtype=int, device=device)
        self._is_first = wp.zeros(nworld, dtype=int, device=device)
        self._latest = wp.zeros(nworld, dtype=float, device=device)
        self._since = wp.zeros(nworld, dtype=wp.float64, device=device)
        self._present, self._previous, self._sample = (s.lanes(len(card.features)) for _ in range(3))
        self._drag = s.lanes(s.outputs)
        self._frames = Frames()
        shape = (nworld, len(card.links))
        self._frames.rotation = wp.zeros(shape, dtype=wp.mat33, device=device)
        for name in ("origin", "linear", "angular"):
            setattr(self._frames, name, wp.zeros(shape, dtype=wp.vec3, device=device))

    def launch(
        self, m: mjw.Model, d: mjw.Data, numbers: Arrays, gust: wp.array, share: wp.array, wrench: wp.array
    ) -> None:
        """Take what samples are due, and add the force of the present time.

        Args:
            gust: of each world and water [m/s]. share: of each one's robot that is under water.
            wrench: of each world and row; that of the carrying body is written. Torques go into `d.qfrc_passive`.
        """
        s = self._sampling
        wp.launch(
            take_samples,
            dim=self._nworld,
            inputs=[m.opt.timestep, d.time, d.qpos, d.qvel, d.xpos, numbers, gust, self._reading, self._period]
            + [self._phase, self._is_first, self._latest, self._since, self._present.numbers, self._previous.numbers],
            outputs=[self._sample.numbers, s.starts.numbers, s.due.numbers],
            device=self._device,
        )
        wp.launch(
            encode,
            dim=self._nworld,
            inputs=[s.due.numbers, self._sample.numbers, self._encoding, self._limits, self._frames],
            outputs=[s.z.numbers, self._drag.numbers],
            device=self._device,
        )
        self._network.observe()
        forces = [s.now.numbers, s.next.numbers]
        wp.launch(
            hold,
            dim=self._nworld,
            inputs=[s.due.numbers, self._limits, self._drag.numbers, self._network.predicts_next, *forces, self._phase],
            device=self._device,
        )
        wp.launch(
            act,
            dim=self._nworld,
            inputs=[self._phase, self._since, self._period, *forces, self._drag.numbers, self._places, self._row]
            + [self._reading.water, share],
            outputs=[wrench, d.qfrc_passive],
            device=self._device,
        )


def checkpoints(m: mjw.Model, model: mujoco.MjModel, water: Water, nworld: int) -> list[Learned]:
    """The checkpoints of all instances of a model's water."""
    made = []
    for number, instance in enumerate(water.instances):
        if instance.learned is not None:
            row = next(at for at, each in enumerate(water.rows) if (each.water, each.body) == (number, instance.body))
            carrier = Carrier(instance.body, number, row)
            made.append(Learned(m, model, instance.learned, carrier, f"instance `{instance.name}`", nworld))
    return made


def _check_step(step: float, period: float, where: str) -> None:
    """Refuse a step that would take more than one sample."""
    if step > period * (1 + 1e-6):
        refuse(where, f"a step of {step:g} s, longer than the sample period,", (f"steps up to {period:g} s",))

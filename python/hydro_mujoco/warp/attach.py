"""The water in a simulation of MuJoCo Warp."""

from collections.abc import Callable
from typing import Any

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

from ..errors import DataError
from ..recording.kinematics import name_of
from .arrays import BY_WATER, BY_WORLD, REMEMBERING, Arrays, arrays, dofs
from .checkpoint.learned import checkpoints
from .gusts import blow
from .instances import carriers
from .kernels import into_joints, into_sensors, loads
from .rows import Row, water
from .support import check_options
from .wakes import follow, no_wakes
from .wet import wet_robots

#: Sizes that a Warp model has in common with the MuJoCo model of its water.
SIZES = ("nq", "nv", "nbody", "njnt", "ngeom", "nC")

#: Gusts, in words.
GUSTS = "the key `random` of attribute `current`"
#: Effects that remember the motion, in words.
WAKES = "the effects `wake_memory` and `basset_history`"


class Water:
    """The water of a Warp model: its passive callback, and what may be read and changed of it.

    Attributes:
        bodies: names of the bodies in water, a row each; one that the water of two instances acts on has two rows.
        wrench: force [N] and torque [N m] about the origin of each row's body, in its frame, without the part in
            proportion to acceleration: array of six numbers, shape (nworld, rows). It is that of the last forward pass.
        gust: velocity of the random part of each instance's current [m/s], shape (nworld, instances). Memory: it starts
            anew in a world whose time goes back.
        share: part of the robot under water that each checkpoint's force fades with, shape (nworld, instances); 1 where
            there is no surface or no checkpoint.
        numbers: the coefficients on the device (`arrays.Arrays`); those that `set` knows may differ by world.
    """

    def __init__(self, m: mjw.Model, model: mujoco.MjModel, nworld: int):
        found = water(model)
        device = m.dof_parentid.device
        self.nworld = nworld
        self.bodies = tuple(name_of(model, row.body) for row in found.rows)
        self.numbers: Arrays = arrays(model, found, device)
        shape = (nworld, len(found.rows))
        self.wrench = wp.zeros(shape, dtype=wp.spatial_vector, device=device)
        self._force = wp.zeros(shape, dtype=wp.spatial_vector, device=device)
        self._inertia = wp.zeros(shape, dtype=wp.spatial_matrix, device=device)
        waters = (nworld, len(found.instances))
        self.gust = wp.zeros(waters, dtype=wp.vec3, device=device)
        self._latest = wp.zeros(waters, dtype=float, device=device)
        self._draws = wp.zeros(waters, dtype=int, device=device)
        self.has_gusts = any(instance.current.has_gusts for instance in found.instances)
        self._learned_wrench = wp.zeros(shape, dtype=wp.spatial_vector, device=device)
        self._fades = any(found.robots)
        self.share = wp.ones(waters, dtype=float, device=device)
        self._learned = checkpoints(m, model, found, nworld)
        self._wakes = no_wakes(shape, device)
        self.has_wakes = any(np.any(row.wake) or np.any(row.basset) for row in found.rows)
        self._options = m.opt
        self._rows_start, self._rows_of_dof = _rows_by_dof(model, found.rows, device)
        self._sensor_adr, self._sensor_body = _sensors(m, model, device)
        self._earlier: Callable[..., None] | None = m.callback.passive
        self._earlier_sensor: Callable[..., None] | None = m.callback.sensor

    @property
    def memory(self) -> str:
        """The first part of the water that has a memory, in words; empty where none has."""
        if self._learned:
            return "attribute `checkpoint`"
        if self.has_wakes:
            return WAKES
        return GUSTS if self.has_gusts else ""

    def set(self, name: str, values: np.ndarray) -> None:
        """Change a coefficient, in all worlds or in each.

        Where the step is captured in a CUDA graph: before the capture.

        Args:
            name: one of `arrays.BY_WORLD` and `arrays.BY_WATER`: `added_mass`, `linear_drag` (6 x 6, about the body's
                origin), `current` [m/s], `gust_seed`, ...
            values: shape (1 or nworld, rows, ...), as `numbers.NAME.numpy()` gives them; instances in place of rows
                where it is of the water.

        Raises:
            DataError: no coefficient is called so, the values have another shape or are not finite, an added mass has
                no room in MuJoCo's inertia matrix, or gusts meet RK4.
        """
        types = BY_WORLD | BY_WATER
        if name not in types:
            raise DataError(f"no coefficient is called `{name}`; there are: {', '.join(types)}")
        known: wp.array = getattr(self.numbers, name)
        shape = known.numpy().shape[1:]
        given = np.asarray(values, dtype=known.numpy().dtype)
        if given.shape not in ((1, *shape), (self.nworld, *shape)):
            raise DataError(
                f"`{name}` has the shape {given.shape}; expected {(1, *shape)} or {(self.nworld, *shape)}: worlds, "
                f"{'instances' if name in BY_WATER else 'rows'}, numbers"
            )
        if not np.isfinite(given).all():
            raise DataError(f"`{name}` holds {given[~np.isfinite(given)][0]}; expected finite numbers")
        if name == "added_mass":
            self._check_room(given)
        if name == "gust_deviation":
            check_options(self._options, memory=GUSTS if given.any() else "")
            self.has_gusts = bool(given.any())
        if name in REMEMBERING and given.any():
            check_options(self._options, memory=WAKES)
            self.has_wakes = True
        setattr(self.numbers, name, wp.array(given, dtype=types[name], device=known.device))
        self.numbers.may_push.fill_(True)

    def _check_room(self, added_mass: np.ndarray) -> None:
        """Refuse inertia on a body whose inertia MuJoCo keeps as a diagonal."""
        full = ~self.numbers.has_room.numpy() & added_mass.any(axis=(0, 2, 3))
        if full.any():
            body = self.bodies[int(np.argmax(full))]
            raise DataError(
                f"`added_mass` on body `{body}`, whose inertia MuJoCo keeps as a diagonal without room for it;\n"
                f'put an empty child into the body, <body name="{body}_water"/>'
            )

    def passive(self, m: mjw.Model, d: mjw.Data) -> None:
        """Add the water's forces and inertia: what MuJoCo Warp calls at the end of its passive forces."""
        if self._earlier:
            self._earlier(m, d)
        if d.nworld != self.nworld:
            raise DataError(f"the data has {d.nworld} worlds, and the water was attached for {self.nworld}")
        device = self.wrench.device
        flags, kind = m.opt.disableflags, m.opt.integrator
        if self.has_gusts:
            wp.launch(
                blow,
                dim=self.gust.shape,
                inputs=[m.opt.timestep, d.time, self.numbers, self._latest, self._draws],
                outputs=[self.gust],
                device=device,
            )
        if self._fades:
            inputs = [d.time, d.xpos, d.xmat, self.numbers]
            wp.launch(wet_robots, dim=self.share.shape, inputs=inputs, outputs=[self.share], device=device)
        for learned in self._learned:
            learned.launch(m, d, self.numbers, self.gust, self.share, self._learned_wrench)
        if self.has_wakes:
            inputs = [m.opt.timestep, d.time, self.numbers, self._wakes]
            wp.launch(follow, dim=self.wrench.shape, inputs=inputs, device=device)
        has_gravity = not flags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
        is_implicit = kind != mujoco.mjtIntegrator.mjINT_RK4
        wp.launch(
            loads,
            dim=self.wrench.shape,
            inputs=[m.opt.timestep, m.opt.gravity, m.body_rootid, m.dof_parentid]
            + [d.time, d.qvel, d.xpos, d.xmat, d.subtree_com, d.cvel, d.cdof_dot]
            + [self.numbers, self.gust, self._learned_wrench, self._wakes, has_gravity, is_implicit],
            outputs=[self.wrench, self._force, self._inertia],
            device=device,
        )
        wp.launch(
            into_joints,
            dim=(d.nworld, m.nv),
            inputs=[m.dof_parentid, m.M_rowadr, m.M_rownnz, d.cdof, self.numbers, self._rows_start, self._rows_of_dof]
            + [self._force, self._inertia],
            outputs=[d.qfrc_passive, d.M],
            device=device,
        )
        # `step1` has factored M before the water added to it; `step` and `forward` do so afterwards.
        mjw.factor_m(m, d)

    def sensor(self, m: mjw.Model, d: mjw.Data, stage: Any) -> None:
        """Fill the sensors of `hydro.wrench`: what MuJoCo Warp calls after each of its stages of sensors."""
        if self._earlier_sensor:
            self._earlier_sensor(m, d, stage)
        if stage.name == "VEL" and self._sensor_adr.size:
            wp.launch(
                into_sensors,
                dim=(d.nworld, self._sensor_adr.size),
                inputs=[self._sensor_adr, self._sensor_body, self.numbers, self.wrench],
                outputs=[d.sensordata],
                device=self.wrench.device,
            )


def attach(m: mjw.Model, model: mujoco.MjModel, *, nworld: int) -> Water:
    """Put the water of a MuJoCo model into a Warp model: `mujoco_warp.step(m, d)` then has it.

    The same attributes and effects as the plugin's, from the same model; `support` lists which. Forces are added to
    `qfrc_passive`, added mass and the implicit part of drag to `M`, as the plugin does. A passive callback that is
    there already acts first.

    Args:
        m: of `mujoco_warp.put_model`, of the same MJCF without the plugin (`without_plugin`).
        model: compiled with the plugin.
        nworld: number of worlds of the data that will be stepped.

    Raises:
        DataError: the two models differ, the model has no water, or something of it that MuJoCo Warp does not get:
            an attribute, an effect, a shape of a hull, an integrator; nothing is attached then.

    Source: the laws of crates/effects, in single precision (docs/warp.md).
    """
    for size in SIZES:
        if getattr(m, size) != getattr(model, size):
            raise DataError(
                f"the Warp model has {size} = {getattr(m, size)} and the MuJoCo model {getattr(model, size)}: make it "
                "of the same MJCF, mujoco_warp.put_model(without_plugin(spec).compile())"
            )
    if nworld < 1:
        raise DataError(f"nworld is {nworld}; expected 1 or more")
    made = Water(m, model, nworld)
    check_options(m.opt, memory=made.memory)
    m.callback.passive, m.callback.sensor = made.passive, made.sensor
    return made


def _rows_by_dof(model: mujoco.MjModel, rows: list[Row], device: wp.Device) -> tuple[wp.array, wp.array]:
    """For each degree of freedom the rows of the bodies that it moves: where they start in a list, and the list."""
    moved_by = [set(dofs(model, row.body)) for row in rows]
    lists = [[number for number, moving in enumerate(moved_by) if dof in moving] for dof in range(model.nv)]
    starts = np.concatenate([[0], np.cumsum([len(each) for each in lists])])
    flat = [number for each in lists for number in each]
    return (
        wp.array(starts.astype(np.int32), dtype=int, device=device),
        wp.array(np.array(flat, dtype=np.int32), dtype=int, device=device),
    )


def _sensors(m: mjw.Model, model: mujoco.MjModel, device: wp.Device) -> tuple[wp.array, wp.array]:
    """Places in `sensordata` and bodies of the plugin's sensors; none where the Warp model has other sensors."""
    adr, body = [], []
    if m.nsensordata == model.nsensordata:
        for carrier, number in carriers(model).items():
            for sensor in np.flatnonzero(model.sensor_plugin == number):
                adr.append(int(model.sensor_adr[sensor]))
                body.append(carrier)
    return wp.array(adr, dtype=int, device=device), wp.array(body, dtype=int, device=device)

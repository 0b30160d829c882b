"""One case, made from its plan: the open folder and the sealed one."""

import copy
import hashlib
import json
import os
import shutil
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import mujoco
import numpy as np

from . import HiddenCaseError, measurement, perturbation, trialfile
from .effects import Effect, Readings
from .plant import Plant, Recording
from .strength import Layout, Nuisances, Windows, effect_columns, remainder
from .systems import SYSTEMS
from .systems.base import Schedule, System

SCHEMA = "hydro-hidden-case/1"
#: Trials beside those that the tool is shown, kept for a replay: as many again are driven faster. Of a small case half.
NEVER_SHOWN = 4
#: How much faster.
FASTER = 1.5
#: Factors on an effect's base parameters that the pilot tries.
LADDER = np.geomspace(0.03, 5.0, 4)
#: Windows of one second from which the nuisances' share is estimated.
PROJECTED_WINDOWS = 10
#: Distance below which two effects cannot be told apart (a squared distance of 9).
LIKE = 3.0


@dataclass(frozen=True)
class Spec:
    """The plan of a case. effects: kinds; target: projected strengths to aim at, one for each effect, or `factors` on
    its base parameters that are taken as they are.
    """

    index: int
    seed: int
    kind: str  # single | null | pair | several | outside | inseparable
    system: str
    effects: tuple[str, ...]
    target: tuple[float, ...]
    noise: float
    small: bool = False
    factors: tuple[float, ...] = ()

    @property
    def case_id(self) -> str:
        """A name that tells nothing."""
        return hashlib.sha256(f"hidden {self.seed} {self.index} {self.small}".encode()).hexdigest()[:12]

    def generator(self, stream: int) -> np.random.Generator:
        """Random numbers of one purpose."""
        return np.random.default_rng([self.seed, self.index, stream])


@dataclass
class Whole:
    """All trials of a case and how strongly its effects show."""

    record: Recording
    fine: list[np.ndarray]
    raw: float
    projected: float
    problem: "Problem | None"
    distances: dict[str, float] = field(default_factory=dict)


@dataclass
class Problem:
    """A few windows that stand for all: the hidden change, what nuisances do, and how to run others there."""

    windows: Windows
    coarse: mujoco.MjModel
    water: Callable | None
    change: np.ndarray  # [windows, rows, ns'] whitened; what nuisance parameters explain in it is linear in them
    raw: float  # norm of the change itself
    nuisances: np.ndarray  # [windows, rows, ns', p]
    share: float  # weight of a window


def _part(problem: Problem) -> float:
    return remainder(problem.change, problem.nuisances) / problem.raw if problem.raw > 1e-9 else 0.0


class Case:
    """Makes the truth of a spec and runs it."""

    def __init__(self, spec: Spec, system: System | None = None):
        self.spec = spec
        self.system: System = SYSTEMS[spec.system]() if system is None else system
        rng = spec.generator(1)
        self.xml = self.system.nominal_xml(spec.noise)
        self.nominal = self.system.plain_model(self.xml)
        self.layout = Layout.from_model(self.nominal)
        if not self.system.filtered:
            self.layout = replace(self.layout, bandwidth=dict.fromkeys(self.layout.bandwidth, float("inf")))
        self.lead = self.nominal.opt.timestep
        self.truth = self.system.plain_model(self.xml)
        self.truth.opt.timestep, self.truth.opt.integrator = self.system.truth_step(rng)
        self.amounts = perturbation.perturbed(self.truth, rng, self.system.com, self.system.tie)
        self.schedule = self.system.schedule(rng, small=spec.small)
        self.recorder = measurement.recorder(rng, self.schedule.period)
        self.twin = self.system.twins(self.truth)[spec.effects[0]] if spec.kind == "inseparable" else None
        if self.twin:
            factories = {spec.effects[0]: self.twin.factory}
        else:
            factories = self.system.singles(self.truth) | self.system.outside(self.truth)
        unknown = [kind for kind in spec.effects if kind not in factories]
        if unknown:
            raise HiddenCaseError(f"system {spec.system} has no effect {unknown}; it has {sorted(factories)}")
        effect_rng = spec.generator(2)
        self.effects: list[Effect] = [factories[kind](effect_rng) for kind in spec.effects]
        styles = [self.system.style_for(kind) for kind in spec.effects]
        self.style = self.twin.style if self.twin else next((style for style in styles if style != "normal"), "normal")

    def run(
        self,
        schedule: Schedule,
        stream: int,
        effects: list[Effect],
        *,
        fine: bool,
        copies: int = 1,
        scales: np.ndarray | None = None,
    ) -> Recording:
        """Drive the truth. With `copies` the same trials run several times, at the scales given."""
        drive = self.system.drive(self.spec.generator(stream), self.truth, schedule, self.style)
        if copies > 1:
            drive = drive.tiled(copies)
        if scales is not None:
            for effect in effects:
                effect.scale = np.repeat(scales, schedule.trials)[:, None]
        self.modes = drive.modes
        members = len(drive.qpos)
        plant = Plant(
            self.truth,
            effects,
            qpos=drive.qpos,
            qvel=drive.qvel,
            start=np.zeros(members),
            water=self.system.water(members),
            act=drive.act,
        )
        per_row = round(schedule.period / self.truth.opt.timestep)
        every = range(0, schedule.rows + 1, round(1.0 / schedule.period)) if plant.water is not None else ()
        return plant.run(
            schedule.rows,
            schedule.period,
            drive.policy,
            record_every=1 if fine else per_row,
            lead=self.lead,
            keep_water_at=every,
        )

    def sensed(self, record: Recording, effects: list[Effect], trial: int, scale: float | None = None) -> np.ndarray:
        """Readings of a trial after the sensors' own effects [T, ns]."""
        readings = Readings(record.times, record.sensors[trial].copy(), self.layout.columns, self.layout.quaternions)
        for effect in effects:
            kept = effect.scale
            effect.scale = np.array([[kept.flat[0] if scale is None else scale]], float)
            effect.sense(readings)
            effect.scale = kept
        return readings.values

    def _water_of(self, record: Recording):
        if not record.waters:
            return None

        def pick(trial, first):
            rows = sorted(record.waters)
            waters = [record.waters[row] for row in rows]
            return type(waters[0]).gathered(waters, [rows.index(f) for f in first], trial)

        return pick

    def strength_of(self, record: Recording, sensed: np.ndarray, *, every: int = 1) -> float:
        """Raw strength over windows: `sensed` [trials, K, ns] holds the truth's rows."""
        windows = Windows(record, self.schedule.period, self.lead, every=every)
        shadow = windows.outputs(self.truth, [], self._water_of(record))
        return float(np.linalg.norm(self.layout.whitened(windows.truth(sensed), shadow)))

    def projection(self, record: Recording, sensed: np.ndarray) -> float:
        """Share of the raw strength that the nominal's uncertainties cannot explain, 0..1."""
        return _part(self._problem(record, sensed))

    def distances(self, whole: Whole) -> dict[str, float]:
        """Distance to every other catalogue effect of this system, smallest first.

        It is what of the hidden change remains once the nuisances and the best coefficients of the other
        effect have explained what they can: linear in the coefficients, with the truth's forms.
        """
        problem = whole.problem
        rng = self.spec.generator(6)
        out = {}
        for kind, factory in self.system.rivals(self.truth, self.effects[0]).items():
            # A wave's frequency is no coefficient.
            if kind in self.spec.effects or kind == "waves":
                continue
            # On the hidden effect's own target where the other can be there, else on two others.
            draws = [factory(rng) for _ in range(8)]
            there = [draw for draw in draws if draw.target == self.effects[0].target][:1] or draws[:2]
            parts = [part for draw in there for part in draw.parts()]
            columns = effect_columns(
                problem.windows, self.layout, problem.coarse, parts, scale=0.1, water_of=problem.water
            )
            # Free coefficients: a prior a thousand times wider than this small dose.
            out[kind] = remainder(
                problem.change, np.concatenate([problem.nuisances, 1e3 * problem.share * columns], -1)
            )
        return dict(sorted(out.items(), key=lambda pair: pair[1]))

    def _problem(self, record: Recording, sensed: np.ndarray) -> "Problem":
        windows = Windows(
            record,
            self.schedule.period,
            self.lead,
            most=PROJECTED_WINDOWS if self.truth.nv <= 6 else PROJECTED_WINDOWS // 2,
        )
        water = self._water_of(record)
        truth, shadow = windows.truth(sensed), windows.outputs(self.truth, [], water)
        # Sensitivities need no finer step than the nominal's own.
        coarse = copy.copy(self.truth)
        coarse.opt.timestep, coarse.opt.integrator = self.nominal.opt.timestep, self.nominal.opt.integrator
        most = self.system.most_nuisances or (40 if self.truth.nv <= 6 else 64)
        nuisances = Nuisances(
            windows, self.layout, coarse, water_of=water, most=most, com=self.system.com, tie=self.system.tie
        )
        # A few windows stand for all, against a prior that is there once.
        share = np.sqrt(self.schedule.trials * self.schedule.rows / (len(windows.trial) * windows.rows))
        return Problem(
            windows,
            coarse,
            water,
            change=share * nuisances.unexplained(truth, shadow, share),
            raw=share * float(np.linalg.norm(self.layout.whitened(truth, shadow))),
            nuisances=share * nuisances.columns,
            share=float(share),
        )

    def aim(self, effect: Effect, target: float) -> float:
        """The scale at which `effect` alone has about the projected strength `target`."""
        trials = min(3, self.schedule.trials)
        rows = min(self.schedule.rows, round(6.0 / self.schedule.period))
        pilot = replace(self.schedule, trials=trials, rows=rows)
        ladder = np.minimum(LADDER, effect.most)
        record = self.run(pilot, 4, [effect], fine=False, copies=len(ladder), scales=ladder)
        share = np.sqrt(self.schedule.trials * self.schedule.rows / (trials * rows))
        found = []
        for i, scale in enumerate(ladder):
            part = slice(i * trials, (i + 1) * trials)
            sub = Recording(
                record.sensors[part],
                record.times,
                record.commands[part],
                record.qpos[part],
                record.qvel[part],
                {row: water.copy_members(np.arange(part.start, part.stop)) for row, water in record.waters.items()},
                record.act[part],
            )
            sensed = np.stack([self.sensed(sub, [effect], t, float(scale)) for t in range(trials)])
            if i == len(ladder) // 2:
                part_left = self.projection(sub, sensed)
            found.append(self.strength_of(sub, sensed, every=2) * np.sqrt(2.0) * share)
        curve = np.maximum.accumulate(np.log(np.maximum(found, 1e-9))) + np.arange(len(ladder)) * 1e-9
        wanted = np.log(target / max(part_left, 0.02))
        logs = np.log(ladder)
        if wanted > curve[-1]:
            scale = np.exp(logs[-1] + wanted - curve[-1])
        elif wanted < curve[0]:
            scale = np.exp(logs[0] + wanted - curve[0])
        else:
            scale = np.exp(np.interp(wanted, curve, logs))
        return float(np.clip(scale, effect.least, effect.most))

    def make(self, out: Path) -> dict:
        """Write the case; returns its line of the manifest."""
        spec = self.spec
        scales = list(spec.factors) or [self.aim(effect, target) for effect, target in zip(self.effects, spec.target)]
        whole = self._whole(scales)
        if len(scales) == 1 and not self.twin and not spec.factors:
            # The pilot saw a few trials only; one correction where it was far off.
            off = spec.target[0] / max(whole.projected, 1e-9)
            if not 0.5 < off < 2.0 and self.effects[0].least < scales[0] * off < self.effects[0].most:
                scales = [scales[0] * float(np.clip(off, 0.1, 10.0))]
                whole = self._whole(scales)
        if spec.kind in ("single", "inseparable"):
            whole.distances = self.distances(whole)
        if self.twin:
            # Told apart after all where it is strong: down to where the other effect explains it.
            for _ in range(3):
                distance = whole.distances[self.twin.other]
                if distance <= LIKE:
                    break
                # The difference of two such effects often grows with the square of their size.
                scales = [scales[0] * float((0.8 * LIKE / distance) ** 0.6)]
                whole = self._whole(scales)
                whole.distances = self.distances(whole)
        return self._write(out, whole, scales)

    def _whole(self, scales: list[float]) -> "Whole":
        """All trials, shown and kept back."""
        for effect, scale in zip(self.effects, scales):
            effect.scale = np.array([[scale]])
        shown = self.schedule.trials
        everything = replace(self.schedule, trials=shown + self.kept_back)
        for effect in self.effects:
            effect.forget()
        record = self.run(everything, 3, self.effects, fine=True)
        self.system.check(self.truth, record)
        fine = [self.sensed(record, self.effects, trial) for trial in range(everything.trials)]
        if not self.effects:
            return Whole(record, fine, 0.0, 0.0, None)
        at = np.round(
            (np.arange(1, self.schedule.rows + 1) * self.schedule.period - self.lead) / self.truth.opt.timestep
        ).astype(int)
        rows = np.stack([values[at] for values in fine[:shown]])
        sub = Recording(
            record.sensors[:shown],
            record.times,
            record.commands[:shown],
            record.qpos[:shown],
            record.qvel[:shown],
            {row: water.copy_members(np.arange(shown)) for row, water in record.waters.items()},
            record.act[:shown],
        )
        # Every second window stands for its neighbour too.
        raw = self.strength_of(sub, rows, every=2) * 2**0.5
        problem = self._problem(sub, rows)
        return Whole(record, fine, raw, raw * _part(problem), problem)

    @property
    def kept_back(self) -> int:
        """Trials of each regime that the tool is never shown."""
        return NEVER_SHOWN // 2 if self.spec.small else NEVER_SHOWN

    def _faster(self) -> tuple[Recording, list[np.ndarray]]:
        """Trials beyond what the others reach, for a look at how models extrapolate."""
        for effect in self.effects:
            effect.forget()
        schedule = replace(self.schedule, trials=self.kept_back, speed=FASTER)
        record = self.run(schedule, 6, self.effects, fine=True)
        return record, [self.sensed(record, self.effects, trial) for trial in range(schedule.trials)]

    def _write(self, out: Path, whole: "Whole", scales: list[float]) -> dict:
        spec, shown = self.spec, self.schedule.trials
        coefficients = [effect.equivalent(scale) for effect, scale in zip(self.effects, scales)]
        modes = self.modes[:shown]
        # After these, which are of the motion that the tool sees.
        faster, fast = self._faster()
        with halves(out, spec.case_id) as (open_part, secret_part):
            self._write_halves(open_part, secret_part, whole, coefficients, modes, faster, fast)
        return {"id": spec.case_id, "system": spec.system}

    def _write_halves(
        self, open_part: Path, secret_part: Path, whole: "Whole", coefficients: list, modes: list, faster, fast: list
    ) -> None:
        spec, record, fine, shown = self.spec, whole.record, whole.fine, self.schedule.trials
        (open_part / "trials").mkdir()
        for regime in ("never_shown", "faster"):
            (secret_part / regime).mkdir()
        (open_part / "nominal.xml").write_text(self.system.shown_xml(self.xml))
        rng = spec.generator(5)
        as_csv = spec.index % 12 == 5
        for trial, values in enumerate(fine):
            hidden = trial >= shown
            folder = secret_part / "never_shown" if hidden else open_part / "trials"
            self._log(
                rng,
                folder / f"trial_{trial - shown if hidden else trial:02d}",
                record,
                trial,
                values,
                as_csv=as_csv and not hidden,
            )
        public = {
            "schema": SCHEMA,
            "id": spec.case_id,
            "system": spec.system,
            "nominal": "nominal.xml",
            "trials": shown,
            "row_period": self.schedule.period,
            "format": "csv" if as_csv else "npz",
            "uncertainty": {
                "mass": 0.03,
                "inertia": 0.03,
                "com_m": self.system.com,
                "fluid": 0.03,
                "gain": 0.03,
                "damping": 0.03,
            },
        }
        effects = []
        for effect, values in zip(self.effects, coefficients):
            effects.append(
                {
                    "effect": effect.kind,
                    "target": effect.target,
                    "comparable": effect.comparable,
                    "parameters": [
                        {"name": name, "value": float(value), "unit": unit} for name, (value, unit) in values.items()
                    ],
                }
            )
        near = [kind for kind, distance in whole.distances.items() if distance < LIKE]
        identifiable = spec.kind in ("single", "pair", "several") and not near and bool(whole.projected >= LIKE)
        answer = {
            "schema": SCHEMA,
            "id": spec.case_id,
            "system": spec.system,
            "kind": spec.kind,
            "effects": effects,
            "lookalikes": near,
            "identifiable": identifiable,
            "distances": whole.distances,
            "twin": self.twin.other if self.twin else None,
            "strength": {"projected": whole.projected, "raw": whole.raw, "asked": list(spec.target)},
            "noise": spec.noise,
            "command_noise": self.system.command_noise,
            "recorder": asdict(self.recorder),
            "style": self.style,
            "modes": modes,
            "perturbations": self.amounts,
            "truth_step": self.truth.opt.timestep,
            "truth_integrator": int(self.truth.opt.integrator),
        }
        rng = spec.generator(7)
        for trial, values in enumerate(fast):
            self._log(rng, secret_part / "faster" / f"trial_{trial:02d}", faster, trial, values, as_csv=False)
        (open_part / "case.json").write_text(json.dumps(public, indent=1) + "\n")
        (secret_part / "answer.json").write_text(json.dumps(answer, indent=1) + "\n")

    def _log(
        self, rng: np.random.Generator, stem: Path, record: Recording, trial: int, values: np.ndarray, *, as_csv: bool
    ) -> None:
        """One trial as the recorder takes it."""
        times = np.arange(self.schedule.rows + 1) * self.schedule.period
        labels, readings = measurement.log(
            rng,
            self.recorder,
            self.layout,
            record.times,
            values,
            rows=self.schedule.rows,
            period=self.schedule.period,
            lead=self.lead,
        )
        state = self._initial_state(rng, record.qpos[trial, 0], record.qvel[trial, 0], record.act[trial, 0])
        commands = record.commands[trial]
        if self.system.command_noise:
            commands = commands + rng.normal(0, self.system.command_noise, commands.shape)
        if as_csv:
            trialfile.write_csv(stem.with_suffix(".csv"), self.nominal, times, commands, labels, readings)
        else:
            trialfile.write_npz(stem.with_suffix(".npz"), self.nominal, times, commands, labels, readings, state)

    def _initial_state(
        self, rng: np.random.Generator, qpos: np.ndarray, qvel: np.ndarray, act: np.ndarray
    ) -> np.ndarray:
        """Full-physics state of the nominal, as a rig that stood still could know it: a third of the noise off."""
        model = self.nominal
        state = np.zeros(
            mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS.value) + self.system.plugin_state()
        )
        state[1 : 1 + model.nq] = self.system.known_position(rng, qpos, self.layout)
        state[1 + model.nq : 1 + model.nq + model.nv] = qvel
        state[1 + model.nq + model.nv : 1 + model.nq + model.nv + model.na] = act
        return state


@contextmanager
def halves(out: Path, case_id: str):
    """Empty folders for the open and the sealed half of a case, which take their places when all is written."""
    cases, sealed = out / "cases", out / "sealed"
    open_part, secret_part = cases / f".{case_id}.tmp", sealed / f".{case_id}.tmp"
    for folder in (open_part, secret_part):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
    yield open_part, secret_part
    # The sealed half goes first: a case that the tool can see always has its answer.
    for part, folder in ((secret_part, sealed / case_id), (open_part, cases / case_id)):
        shutil.rmtree(folder, ignore_errors=True)
        os.replace(part, folder)


def is_complete(out: Path, case_id: str) -> bool:
    """Both halves are there."""
    return (out / "cases" / case_id / "case.json").is_file() and (out / "sealed" / case_id / "answer.json").is_file()

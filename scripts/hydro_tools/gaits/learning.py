"""CMA-ES over the generator's numbers in one water.

N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv:1604.00772; the package `cma`. A generation swims from one
start, another each generation, so a gait that only fits one start does not last. The state on disk is what was drawn
and how it scored: a run that was cut off draws the same again, and ends with the same bytes.
"""

import math
from dataclasses import asdict, dataclass
from pathlib import Path

import cma
import numpy as np

from hydro_mujoco.reading import read_json
from hydro_mujoco.recording.files import write_json
from hydro_mujoco.recording.progress import Progress

from ..datasets import DataError
from . import episode, gait_file
from .generator import FIRST, unit_to_values, values_to_unit
from .waters import Water

STATE = "state.json"
STATE_SCHEMA = "hydro-gait-learning/1"
#: Standard deviation of the first generation, of the parameters' ranges.
SPREAD = 0.15
#: Generations whose means are swum again at the end, to choose one by: the last of so many equal parts.
FINALISTS = 4
#: Starts that the finalists swim from.
TRIALS = 8


@dataclass(frozen=True)
class Plan:
    """What is learnt, and with what budget: `generations` of `population` episodes of `seconds`."""

    water: str
    seed: int
    generations: int
    population: int
    seconds: float

    @property
    def episodes(self) -> int:
        """Episodes in all, those of the finalists included."""
        return self.generations * self.population + FINALISTS * TRIALS


def learn(plan: Plan, water: Water, folder: Path, threads: int) -> gait_file.Gait:
    """Learn a gait; goes on where `folder` holds the state of the same plan.

    Raises:
        DataError: `folder` holds the state of another plan, or none that can be read.
    """
    folder.mkdir(parents=True, exist_ok=True)
    scores = _known(folder / STATE, plan)
    model = water.model()
    pool = water.robots(plan.population, threads)
    progress = Progress(plan.generations, "generations", done=len(scores))
    random = np.random.RandomState(plan.seed)
    options = {
        "popsize": plan.population,
        "bounds": [0.0, 1.0],
        "randn": random.randn,
        "seed": math.nan,
        "verbose": -9,
        "verb_log": 0,
    }
    search = cma.CMAEvolutionStrategy(values_to_unit(FIRST), SPREAD, options)
    means = []
    for generation in range(plan.generations):
        drawn = np.array(search.ask())
        if generation == len(scores):
            one = episode.starts(model, _random(plan, generation), 1)
            begin = episode.Starts(*(np.repeat(part, plan.population, axis=0) for part in vars(one).values()))
            found = episode.score(episode.swim(pool, unit_to_values(drawn), begin, plan.seconds))
            scores.append([float(value) for value in found])
            write_json(folder / STATE, {"schema": STATE_SCHEMA, "plan": asdict(plan), "scores": scores})
            progress.advance()
        search.tell(list(drawn), [-value for value in scores[generation]])
        means.append(np.clip(search.result.xfavorite, 0.0, 1.0))
    values, best = _finalist(plan, water, np.array(means), threads)
    return gait_file.made(
        values,
        gait_file.joints_of(model),
        water=plan.water,
        seed=plan.seed,
        seconds=plan.seconds,
        episodes=plan.episodes,
        score=best,
    )


def _finalist(plan: Plan, water: Water, means: np.ndarray, threads: int) -> tuple[np.ndarray, float]:
    """The best of some generations' means over starts of their own, in the water that it was learnt in."""
    chosen = sorted({len(means) - 1 - part * len(means) // FINALISTS for part in range(FINALISTS)})
    values = np.repeat(unit_to_values(means[chosen]), TRIALS, axis=0)
    begin = episode.starts(water.model(), _random(plan, plan.generations), TRIALS)
    begin = episode.Starts(*(np.tile(part, (len(chosen), 1)) for part in vars(begin).values()))
    track = episode.swim(water.robots(len(values), threads), values, begin, plan.seconds)
    mean = episode.score(track).reshape(len(chosen), TRIALS).mean(axis=1)
    best = int(np.argmax(mean))
    return values[best * TRIALS], float(mean[best])


def _random(plan: Plan, number: int) -> np.random.Generator:
    """The draws of a generation's start."""
    return np.random.default_rng([plan.seed, number])


def _known(path: Path, plan: Plan) -> list[list[float]]:
    """Scores of the generations that are done."""
    if not path.exists():
        return []
    try:
        found = read_json(path, f"state {path}")
    except DataError as error:
        raise DataError(f"{error}; remove it to begin anew") from error
    try:
        other, scores = found["plan"], np.array(found["scores"], float).reshape(-1, plan.population)
    except (ValueError, KeyError, TypeError) as error:
        raise DataError(f"state {path}: {error}; expected {STATE_SCHEMA}; remove it to begin anew") from error
    if found.get("schema") != STATE_SCHEMA or other != asdict(plan):
        raise DataError(f"state {path}: of {other}\nthis run is {asdict(plan)}; name another --out, or remove the file")
    if not np.isfinite(scores).all() or len(scores) > plan.generations:
        raise DataError(f"state {path}: scores are not finite, or of more generations than {plan.generations}")
    return scores.tolist()

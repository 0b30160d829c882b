"""The list of cases: kinds, systems, effects, strengths, noise. A function of the seed alone."""

import numpy as np

from .case import Spec
from .systems import SYSTEMS

#: How many cases of each kind.
COUNTS = {"single": 212, "null": 88, "pair": 64, "outside": 36, "inseparable": 36}
#: Share of each system.
SHARES = {"vehicle": 0.40, "leg": 0.32, "tow": 0.14, "swim": 0.14}
#: Bands of strength: (from, to, share).
BANDS = ((3.5, 10.0, 0.3), (10.0, 30.0, 0.35), (30.0, 100.0, 0.35))
NOISES = (0.5, 1.0, 2.0)


def full(seed: int) -> list[Spec]:
    """Every case, in an order that mixes kinds and systems, so that the first N are a fair sample."""
    rng = np.random.default_rng([seed, 20_000])
    shares = {name: share for name, share in SHARES.items() if name in SYSTEMS}
    menus = {name: _Menu(name) for name in shares}
    drafts = []
    for kind, count in COUNTS.items():
        able = {name: share for name, share in shares.items() if kind != "inseparable" or menus[name].decks[kind]}
        wanted = {name: share / sum(able.values()) * count for name, share in able.items()}
        given = dict.fromkeys(able, 0)
        for _ in range(count):
            system = max(able, key=lambda name: wanted[name] - given[name] + 1e-6 * rng.random())
            given[system] += 1
            drafts.append((kind, system))
    order = rng.permutation(len(drafts))
    return [_spec(int(i), seed, *drafts[j], menus, rng) for i, j in enumerate(order)]


def fixed() -> list[Spec]:
    """The small part for the test script: one or two cases a system, short trials."""
    wanted = [
        ("single", "vehicle", ("quadratic_drag",), (40.0,)),
        ("null", "vehicle", (), ()),
        ("single", "vehicle", ("current",), (40.0,)),
        ("single", "leg", ("joint_friction",), (40.0,)),
        ("null", "leg", (), ()),
        ("single", "tow", ("linear_drag",), (40.0,)),
        ("single", "swim", ("payload",), (40.0,)),
    ]
    return [
        Spec(i, 7, kind, system, effects, target, 1.0, small=True)
        for i, (kind, system, effects, target) in enumerate(wanted)
        if system in SYSTEMS
    ]


class _Menu:
    """Deals the effects of a system in turn, reshuffled a round."""

    def __init__(self, name: str):
        system = SYSTEMS[name]()
        model = system.plain_model(system.nominal_xml(1.0))
        self.decks = {
            "single": sorted(system.singles(model)),
            "outside": sorted(system.outside(model)),
            "inseparable": sorted(system.twins(model)),
        }
        self.hands: dict[str, list] = {}

    def deal(self, deck: str, rng: np.random.Generator):
        hand = self.hands.setdefault(deck, [])
        if not hand:
            hand.extend(self.decks[deck][i] for i in rng.permutation(len(self.decks[deck])))
        return hand.pop()


def _strength(rng: np.random.Generator, *, least: float = 0.0) -> float:
    low, high, _ = BANDS[rng.choice(len(BANDS), p=[share for *_, share in BANDS])]
    return float(np.exp(rng.uniform(np.log(max(low, least)), np.log(max(high, 1.5 * least)))))


#: Two effects that are hardly two: not used as a pair.
TOO_CLOSE = (
    {"net_buoyancy", "payload"},
    {"linear_drag", "quadratic_drag"},
    {"current", "constant_force"},
    {"actuator_lag", "actuator_delay"},
    {"added_mass", "payload"},
    {"joint_armature", "payload"},
    {"joint_armature", "actuator_gain"},
    {"waves", "current"},
    {"quadratic_drag", "cross_flow_drag"},
    {"linear_drag", "wake_memory"},
    {"added_mass", "basset_history"},
    {"linear_drag", "joint_damping"},
    {"free_surface", "wall_proximity"},
    {"waves", "wall_proximity"},
    {"free_surface", "quadratic_drag"},
    {"wall_proximity", "quadratic_drag"},
    {"wake_memory", "basset_history"},
    {"net_buoyancy", "constant_force"},
)


def _spec(index: int, seed: int, kind: str, system: str, menus: dict, rng: np.random.Generator) -> Spec:
    noise = float(rng.choice(NOISES))
    menu = menus[system]
    if kind == "null":
        return Spec(index, seed, kind, system, (), (), noise)
    if kind == "single":
        return Spec(index, seed, kind, system, (menu.deal("single", rng),), (_strength(rng),), noise)
    if kind == "outside":
        return Spec(index, seed, kind, system, (menu.deal("outside", rng),), (_strength(rng, least=12.0),), noise)
    if kind == "inseparable":
        return Spec(
            index, seed, kind, system, (menu.deal("inseparable", rng),), (float(rng.uniform(10.0, 25.0)),), noise
        )
    first = menu.deal("single", rng)
    while True:
        second = menu.deal("single", rng)
        if second != first and {first, second} not in TOO_CLOSE:
            break
    return Spec(
        index, seed, kind, system, (first, second), (_strength(rng, least=12.0), _strength(rng, least=12.0)), noise
    )

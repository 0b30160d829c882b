"""How a card's samples are encoded, on the device."""

import mujoco
import numpy as np
import warp as wp

from .card import Card
from .kernels.encode import Encoding
from .robot import ANGULAR, DENSITY, LINEAR, POSITION, QUATERNION, VELOCITY, Feature, Put, feature

#: Kinds of joints of links.
KINDS = {"hinge": 1, "slide": 2}


def encoding(card: Card, put: Put) -> Encoding:
    """The encoding of a card, with the places of its features."""
    features = [feature(name) for name in card.features]

    def all_of(kind: int) -> list[int]:
        return [place for place, each in enumerate(features) if each.kind == kind]

    def place(kind: int, of: str) -> int:
        each = Feature(kind, of)
        return features.index(each) if each in features else -1

    out = Encoding()
    out.mean, out.std = put(card.input_mean, float), put(card.input_std, float)
    quaternion, density = all_of(QUATERNION), all_of(DENSITY)
    out.quaternion = quaternion[0] if quaternion else -1
    out.density = density[0] if density else -1
    out.has_up = card.encoding != "raw" and bool(quaternion)
    out.has_forms = card.encoding in ("hydrodynamic", "links")
    for name, kind in (("linear", LINEAR), ("angular", ANGULAR), ("joints", VELOCITY)):
        setattr(out, name, put(np.array(all_of(kind), dtype=int), int))
    out.base_linear = put([place(LINEAR, axis) for axis in "xyz"], int)
    out.base_angular = put([place(ANGULAR, axis) for axis in "xyz"], int)
    _put_links(out, card, features, put)
    return out


def _put_links(out: Encoding, card: Card, features: list[Feature], put: Put) -> None:
    links = card.links
    joints = [link.get("joint") or {} for link in links]

    def vectors(values: list) -> np.ndarray:
        return np.reshape(np.array(values, dtype=float), (-1, 3))

    def places(kind: int) -> list[int]:
        wanted = [Feature(kind, joint.get("name", "")) for joint in joints]
        return [features.index(each) if each in features else -1 for each in wanted]

    rotation = np.zeros((len(links), 9))
    for matrix, link in zip(rotation, links, strict=True):
        mujoco.mju_quat2Mat(matrix, link["rotation"])
    out.parent = put(np.array([-1 if link.get("parent") is None else link["parent"] for link in links], dtype=int), int)
    out.rotation = put(rotation.reshape(-1, 3, 3), wp.mat33)
    out.kind = put(np.array([KINDS.get(joint.get("kind", ""), 0) for joint in joints], dtype=int), int)
    out.position, out.velocity = (put(np.array(places(kind), dtype=int), int) for kind in (POSITION, VELOCITY))
    for name in ("origin", "centre", "along"):
        setattr(out, name, put(vectors([link[name] for link in links]), wp.vec3))
    out.axis = put(vectors([joint.get("axis", [0, 0, 0]) for joint in joints]), wp.vec3)

"""The tree of links in a manifest, walked here, against where MuJoCo puts the hulls and how it moves them."""

import unittest
from unittest import mock

import mujoco
import numpy as np

from hydro_mujoco.recording import kinematics
from hydro_tools.datasets import DataError, scene


def turn(quaternion):
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.asarray(quaternion, float))
    return matrix.reshape(3, 3)


def tree(model):
    """The links of a scene's hulls."""
    base = model.body("trunk").id
    return kinematics.tree(model, base, kinematics.hulls(model, base))


class B1(unittest.TestCase):
    def setUp(self):
        self.scene = scene.load()
        self.tree = tree(self.scene.model)["links"]

    def test_every_link_once_parents_first(self):
        self.assertEqual(len(self.tree), 13)
        self.assertEqual(self.tree[0]["name"], "trunk")
        joints = [link["joint"]["name"] for link in self.tree[1:]]
        self.assertEqual(sorted(joints), sorted(self.scene.joints))
        for at, link in enumerate(self.tree):
            self.assertLess(link.get("parent", -1), at)

    def test_hulls_are_where_mujoco_has_them(self):
        model, data = self.scene.model, mujoco.MjData(self.scene.model)
        rng = np.random.default_rng(3)
        angles = rng.uniform(*self.scene.joint_range.T)
        data.qpos[7:] = angles
        data.qpos[:7] = 0, 0, 0, 1, 0, 0, 0
        mujoco.mj_kinematics(model, data)
        by_name = dict(zip(self.scene.joints, angles))
        frames = []
        for link in self.tree:
            origin, axes = frames[link["parent"]] if "parent" in link else (np.zeros(3), np.eye(3))
            origin, axes = origin + axes @ link["origin"], axes @ turn(link["rotation"])
            if "joint" in link:
                half = by_name[link["joint"]["name"]] / 2
                axes = axes @ turn([np.cos(half), *(np.sin(half) * np.array(link["joint"]["axis"]))])
            frames.append((origin, axes))
            hull = data.geom(f"{link['name']}_hull")
            np.testing.assert_allclose(origin + axes @ link["centre"], hull.xpos, atol=1e-12)
            longest = np.argmax(model.geom(f"{link['name']}_hull").size)
            np.testing.assert_allclose(axes @ link["along"], hull.xmat.reshape(3, 3)[:, longest], atol=1e-12)

    def test_what_is_no_such_tree_is_refused(self):
        ball = """<mujoco><worldbody><body name="trunk"><freejoint/><geom size="0.1" fluidshape="ellipsoid"/>
          <body name="leg"><joint name="knee" type="ball"/><geom size="0.1" fluidshape="ellipsoid"/></body></body></worldbody></mujoco>"""
        model = mujoco.MjModel.from_xml_string(ball)
        with self.assertRaisesRegex(DataError, "body `leg`, joint `knee`: type is ball; expected hinge or slide"):
            tree(model)
        turned = ball.replace('type="ball"', 'type="slide" ref="0.5"')
        with self.assertRaisesRegex(DataError, "body `leg`, joint `knee`: ref is 0.5 m; expected 0"):
            tree(mujoco.MjModel.from_xml_string(turned))
        with mock.patch.object(kinematics, "MOST_LINKS", 1):
            with self.assertRaisesRegex(DataError, "body `trunk` has 2 links; expected 1 at most"):
                tree(mujoco.MjModel.from_xml_string(ball.replace("ball", "hinge")))
        bare = ball.replace(
            '<joint name="knee" type="ball"/><geom size="0.1" fluidshape="ellipsoid"/>',
            '<geom size="0.1"/><body name="foot"><geom size="0.1" fluidshape="ellipsoid"/></body>',
        )
        with self.assertRaisesRegex(DataError, "body `foot` hangs on `leg`, which has no hull"):
            tree(mujoco.MjModel.from_xml_string(bare))


if __name__ == "__main__":
    unittest.main()

"""What is seen and does not act: the goal's marker, whose pose holds the goal, the still surface, a camera."""

import mujoco

#: Names of the mocap body and of the camera that follows.
GOAL, CAMERA = "goal", "track"


def add_goal(spec: mujoco.MjSpec, size: float) -> None:
    """Add the goal to a spec: a ball, and a rod along its x axis.

    size: the ball's radius [m].
    """
    goal = spec.worldbody.add_body(name=GOAL, mocap=True)
    looks = {"contype": 0, "conaffinity": 0, "group": 2, "rgba": [0.2, 0.9, 0.4, 0.5]}
    goal.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[size, 0, 0], **looks)
    rod = [0, 0, 0, 4 * size, 0, 0]
    goal.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=rod, size=[0.2 * size, 0, 0], **looks)


def add_camera(body: mujoco.MjsBody) -> None:
    """Add a camera that follows a body from 2.3 m away, without turning with it."""
    follows = body.add_camera(name=CAMERA, mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM, pos=[1.4, -1.75, 0.6])
    follows.alt.type = mujoco.mjtOrientation.mjORIENTATION_XYAXES
    follows.alt.xyaxes = [0.78, 0.62, 0, -0.16, 0.2, 0.97]


def add_surface(spec: mujoco.MjSpec, waterline: float) -> None:
    """Add a translucent plane without end at world z = waterline [m]; the waves are not drawn."""
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 1],
        pos=[0, 0, waterline],
        rgba=[0.1, 0.45, 0.65, 0.35],
        contype=0,
        conaffinity=0,
        group=2,
    )

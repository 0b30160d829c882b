"""The built-in run: controls that look like swimming."""

import numpy as np

from hydro_tools.datasets import gait, scene


def choreography(seconds: float, density: float) -> dict:
    """A run that looks like swimming: a trot that becomes a paddle, from the standing posture."""
    t = np.arange(round(seconds / scene.SAMPLE_PERIOD)) * scene.SAMPLE_PERIOD

    def swing(pattern: str, frequency: float, amplitude: tuple, centre: tuple) -> np.ndarray:
        # The calf trails the thigh by a quarter of a cycle: it folds on the way forward.
        phase = 2 * np.pi * np.array(gait.PATTERNS[pattern])[:, None] + np.array([0.0, 0.0, -np.pi / 2])
        return gait.Gait(np.tile(centre, 4), np.tile(amplitude, 4), frequency, phase.ravel(), 0.15).targets(t)

    ctrl = gait.hold(np.tile(gait.CENTRE, 4)).targets(t)
    gait.crossfade(ctrl, swing("trot", 0.9, (0.05, 0.55, 0.5), (0.0, 0.75, -1.5)), 0, 80)
    half = len(t) // 2
    gait.crossfade(ctrl, swing("paddle", 0.7, (0.2, 0.6, 0.6), (0.1, 0.6, -1.35))[half:], half, 60)
    joint_range = scene.load().joint_range
    qpos = np.concatenate(([0, 0, 0, 1, 0, 0, 0], np.tile(gait.CENTRE, 4)))
    return {
        "qpos": qpos[None],
        "qvel": np.zeros((1, 18)),
        "ctrl": gait.within(ctrl, joint_range),
        "push": np.zeros((len(t), 6)),
        "density": density,
    }

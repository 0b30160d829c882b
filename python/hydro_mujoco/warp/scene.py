"""The model that MuJoCo Warp takes: without engine plugins."""

import mujoco

from ..errors import DataError
from ..plugin import WRENCH, load_plugin

#: Numbers of the sensor of `hydro.wrench`: force and torque.
WRENCH_LEN = 6


def without_plugin(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """A copy of a spec without `hydro.wrench`: what `mujoco_warp.put_model` and `make_data` take, compiled.

    Bodies, joints and the places of all readings in `sensordata` are those of the spec: a sensor of the plugin becomes
    one of type `user` with the same six numbers, which `attach` fills.

    Args:
        spec: of an MJCF with instances of `hydro.wrench`; it stays as it is.

    Raises:
        DataError: the spec has another plugin, which MuJoCo Warp does not take either; `hydro.load_cell` is one.
    """
    load_plugin()
    plain = spec.copy()
    for sensor in plain.sensors:
        if sensor.type != mujoco.mjtSensor.mjSENS_PLUGIN:
            continue
        if sensor.plugin.plugin_name != WRENCH:
            raise DataError(
                f"sensor `{sensor.name}` is of the plugin {sensor.plugin.plugin_name}, which does not act in MuJoCo "
                "Warp; take it out of the spec"
            )
        sensor.plugin.active = False
        sensor.type, sensor.dim = mujoco.mjtSensor.mjSENS_USER, WRENCH_LEN
        sensor.datatype = mujoco.mjtDataType.mjDATATYPE_REAL
        sensor.needstage = mujoco.mjtStage.mjSTAGE_VEL
        sensor.objtype = mujoco.mjtObj.mjOBJ_UNKNOWN
    for body in plain.bodies:
        if body.plugin.active and body.plugin.plugin_name == WRENCH:
            body.plugin.active = False
    for plugin in list(plain.plugins):
        if plugin.plugin_name == WRENCH:
            plain.delete(plugin)
    return plain

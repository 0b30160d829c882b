"""B1's scenes as nominal models of `hydro gap`: no looks, `noise` on every sensor, MuJoCo's own load cell."""

import xml.etree.ElementTree as ET

from ..repository import ROOT

#: Standard deviation by sensor element: rad, rad/s, m/s, m/s^2, m, N, N m.
NOISE = {
    "gyro": 0.01,
    "accelerometer": 0.1,
    "framequat": 0.006,
    "velocimeter": 0.02,
    "jointpos": 0.003,
    "jointvel": 0.05,
    "framepos": 0.01,
    "framelinvel": 0.01,
    "force": 2.0,
    "torque": 0.6,
}


def bare(source: str, header: str) -> ET.Element:
    """The scene without looks, cameras, lights and textures, with noise on every sensor."""
    root = ET.fromstring((ROOT / "mjcf" / source).read_text())
    for parent in list(root.iter()):
        for child in list(parent):
            # The carriage's little sphere stays: its zero coefficients keep the box fluid off it.
            looks = child.get("class") == "look" and child.get("name") != "carriage"
            if looks or child.tag in ("visual", "asset", "camera", "light", ET.Comment):
                parent.remove(child)
    for element in root.iter():
        element.attrib.pop("material", None)
        if element.get("class") == "look":
            element.attrib.pop("class")
    for sensor in root.find("sensor"):
        if sensor.tag in NOISE:
            sensor.set("noise", str(NOISE[sensor.tag]))
    root.insert(0, ET.Comment(f" {header} "))
    return root


def tow() -> ET.Element:
    """B1 under the carriage; the cell is MuJoCo's own."""
    root = bare("b1_tow.xml", "Written by scripts/make_gap_scenes.py from mjcf/b1_tow.xml. Do not edit.")
    root.remove(root.find("extension"))
    # The servos are stiff and the cell feels accelerations: Euler's own error would be the largest gap there is.
    root.find("option").set("integrator", "RK4")
    sensors = root.find("sensor")
    for sensor in list(sensors):
        name = sensor.get("name")
        if sensor.tag == "plugin" or name.startswith("imu_"):
            sensors.remove(sensor)
        elif name.endswith("_dry"):
            sensor.set("name", name.removesuffix("_dry"))
    for axis in "xy":
        ET.SubElement(sensors, "jointpos", name=f"carriage_{axis}_position", joint=f"gantry_{axis}", noise="0.001")
        ET.SubElement(sensors, "jointvel", name=f"carriage_{axis}_velocity", joint=f"gantry_{axis}", noise="0.005")
    for sensor in list(sensors):
        if sensor.get("name") in ("gantry_position", "gantry_velocity"):
            sensors.remove(sensor)
    return root


def swim() -> ET.Element:
    """B1 in the learned water, with a position from outside."""
    root = bare("b1_swim.xml", "Written by scripts/make_gap_scenes.py from mjcf/b1_swim.xml. Do not edit.")
    sensors = root.find("sensor")
    for sensor in list(sensors):
        if sensor.tag == "plugin":
            sensors.remove(sensor)
    first = ET.Element("framepos", name="position", objtype="xbody", objname="trunk", noise=str(NOISE["framepos"]))
    sensors.insert(0, first)
    for sensor in sensors:
        if sensor.get("name") == "base_quaternion":
            sensor.set("name", "attitude")
    return root


def text(root: ET.Element) -> str:
    """Indented, with a line end."""
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"

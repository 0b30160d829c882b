"""The files that B1's table gives: URDF and MuJoCo scenes, by path."""

from . import identified, mjcf, urdf

#: Names the table's former place (it is hydro_tools/robot/table.py): recorded manifests hold the scene's sha256, so the
#: scene's bytes stay.
SOURCE = "Written by scripts/make_b1.py; numbers and their source in scripts/b1_model/table.py. Do not edit."
#: The scene with identified coefficients, relative to the repository.
IDENTIFIED = "mjcf/b1_truth.xml"


def header(litres: float) -> str:
    """The comment on top of a scene."""
    return f"{SOURCE} Displaced volume {litres:g} L."


def identified_scene(litres: float, fluid: mjcf.Coefficients) -> str:
    """The truth with coefficients that `real_to_sim.py` identified."""
    return mjcf.identified(
        f"{header(litres)} Fluid coefficients: scripts/b1_model/identified.json, by scripts/real_to_sim.py.",
        litres,
        fluid,
    )


def files(litres: float) -> dict[str, str]:
    """Contents by path relative to the repository."""
    top = header(litres)
    return {
        "models/robots/b1.urdf": urdf.urdf(SOURCE),
        "mjcf/b1.xml": mjcf.robot(top, litres),
        "mjcf/b1_truth_default.xml": mjcf.truth(top, litres),
        IDENTIFIED: identified_scene(litres, identified.read()),
        "mjcf/b1_box_fluid.xml": mjcf.box_fluid(top, litres),
        "mjcf/b1_swim.xml": mjcf.swim(top, litres),
        "mjcf/b1_tow.xml": mjcf.tow(top, litres),
    }

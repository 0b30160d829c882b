"""The report for people, in Markdown."""

from .coefficients import OFFSETS
from .result import MODELS
from .scores import AXES


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)] + [""]


def _spread(entry: dict, digits: int = 2, factor: float = 1.0) -> str:
    low, high = (factor * end for end in entry["ci95"])
    return f"{factor * entry['value']:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def _interval(ends: list[float]) -> str:
    return f"{ends[0]:.3f} to {ends[1]:.3f}"


def _errors(report: dict) -> list[str]:
    rows = []
    models = [(title, report["errors"][model]) for model, title in MODELS.items()]
    models.append(("identified without the tow's configuration", {"all": report["left_out_configuration"]["all"]}))
    names = {"fitted": "fitted", "held_out": "**held out**", "all": "all, each left out"}
    for title, sets in models:
        for name, errors in sets.items():
            rows.append(
                [
                    title,
                    names[name],
                    *(_spread(errors["rmse"][axis]) for axis in (*AXES, "pooled")),
                    f"{100 * errors['nrmse']['pooled']['value']:.0f} %",
                    _spread(errors["relative"], 0, 100) + " %",
                ]
            )
    return _table(["model", "tows", "RMSE x [N]", "RMSE y [N]", "RMSE both [N]", "nRMSE", "mean relative error"], rows)


def _left_out(report: dict) -> list[str]:
    rows = [
        [
            str(row["configuration"]),
            f"{row['thigh']:g}",
            f"{row['calf']:g}",
            *(f"{row['rmse'][axis]:.2f}" for axis in (*AXES, "pooled")),
            f"{100 * row['nrmse']:.0f} %",
            f"{100 * row['relative']:.0f} %",
        ]
        for row in report["left_out_configuration"]["each"]
    ]
    return _table(
        [
            "configuration",
            "thigh [rad]",
            "calf [rad]",
            "RMSE x [N]",
            "RMSE y [N]",
            "RMSE both [N]",
            "nRMSE",
            "mean relative error",
        ],
        rows,
    )


def _coefficients(report: dict) -> list[str]:
    rows = []
    for row in report["coefficients"]:
        prior = row["prior"]
        rows.append(
            [
                row["name"] + (" [N]" if row["name"] in OFFSETS else ""),
                f"{row['default']:g}",
                f"{prior['centre']:.3f} ± {prior['sd']:.3f}",
                f"**{row['value']:.3f}**" if row["identified"] else f"{row['value']:.3f}",
                _interval(row["ci95"]),
                _interval(row["ci95_blocks"]),
                f"{row['sd_after_over_before']:.2f}",
                _interval(row["other_priors"]),
                "yes" if row["identified"] else "no",
            ]
        )
    return _table(
        [
            "coefficient",
            "default",
            "prior",
            "value",
            "95 %, sysid",
            "95 %, bootstrap",
            "sd after / before",
            "other priors",
            "identified",
        ],
        rows,
    )


def _unidentified(report: dict) -> list[str]:
    rows = []
    for row in report["coefficients"]:
        if not row["identified"] and "alike" in row:
            other, ends = row["alike"], row["other_priors"]
            decides = (
                f"other priors take it from {ends[0]:.2f} to {ends[1]:.2f}"
                if row["outweighs"]
                else "the prior says more than the tows"
            )
            rows.append(
                [
                    row["name"],
                    f"{row['value']:.3f}",
                    f"{decides}: its force looks like that of {other['name']} (cosine {other['cosine']:.4f}), and "
                    f"{100 * row['unseen']:.0f} % of its prior variance leaves no trace in any tow",
                ]
            )
    rows.append(
        [
            "density scale",
            "1 (frozen)",
            "the coefficients together make up its force to within "
            f"{report['density_scale']['not_made_up_by_coefficients']:.0e} of it",
        ]
    )
    rows += [
        [row["name"], f"{row['value']:g} (frozen, default)", f"no force in any tow: {row['reason']}"]
        for row in report["without_force"]
    ]
    return _table(["coefficient", "value in the scene", "why"], rows)


def _sum(members: dict[str, float]) -> str:
    return " ".join(f"{'+' if value > 0 else '−'} {abs(value):.2f} {name}" for name, value in members.items())


def _combinations(report: dict) -> list[str]:
    rows = [
        [f"{row['strength']:.2g}" if row["strength"] > 1e-3 else "0", _sum(row["of"])] for row in report["combinations"]
    ]
    return _table(["strength", "combination, in units of each prior's sd (members above 0.25)"], rows)


def _priors(report: dict) -> list[str]:
    names = [row["name"] for row in report["coefficients"] if row["name"] not in OFFSETS]
    rows = [
        [row["prior"], f"{row['rmse_held_out']:.2f}", *(f"{row['coefficients'][name]:.2f}" for name in names)]
        for row in report["priors"]
    ]
    return _table(["prior: centre, sd", "held-out RMSE [N]", *names], rows)


def _unexplained(report: dict) -> list[str]:
    rows = []
    for row in report["unexplained"]:
        forces = []
        for measured, residual, spread in zip(row["measured"], row["residual"], row["spread"]):
            forces += [f"{measured:.2f}", f"{residual:.2f} ± {spread:.2f}"]
        rows.append([row["direction"], f"{row['speed']:g}", *forces, f"{max(row['error']):.2f}"])
    return _table(
        [
            "direction",
            "speed [m/s]",
            "force x [N]",
            "residual x [N]",
            "force y [N]",
            "residual y [N]",
            "standard error [N]",
        ],
        rows,
    )


def _origin(report: dict) -> list[str]:
    tows, source = report["tows"], report["from"]
    by = source.get("towing", "a tank that left no manifest")
    seed = f", seed {source['towing_seed']}" if "towing_seed" in source else ""
    return [
        f"`{source['command']}`, MuJoCo {source['mujoco']}; towing data by {by}{seed}, sha256 of {source['table']} "
        f"`{source['table_sha256']}`.",
        "",
        f"{tows['count']} tows of B1 in {tows['configurations']} leg configurations, {tows['held_out']} of them held out: "
        "never seen by the fit. Data of `gen_task1.py` come from a simulated tank (strip theory, no part of it MuJoCo's), "
        "not from a measured one. Forces are those of the water on the robot along x and y of its base frame.",
        "",
    ]


def _about_errors(report: dict) -> str:
    spread = report["tows"]["force_sd"]
    return (
        "In brackets: 95 % by drawing leg configurations again. nRMSE: over the standard deviation of the measured "
        f"forces of all tows, {spread['x']:.2f} N along x, {spread['y']:.2f} N along y. Relative error: of the force as "
        "a vector. `defaults by judgement` are those of `mjcf/b1_truth_default.xml`; `density scale alone` has them in "
        f"water of {report['levels']['density scale']:.3f} times the density, with the cell's offsets."
    )


def _about_intervals(report: dict) -> str:
    return (
        "The offsets are the load cell's and not in the scene; a torque offset cannot be seen, for the table holds force "
        "x and y. Bounds: 0 to 3. `sysid`: from the Jacobian at the optimum, scaled by the reduced chi-square "
        f"({report['reduced_chi_square']:.2f}), the prior included. `bootstrap`: leg configurations drawn with "
        "replacement, the prior's centre drawn too. Both take the model's form for right up to its share below; they do "
        "not hold what another form would say."
    )


def _about_prior(report: dict) -> str:
    levels = report["levels"]
    return (
        f"*Prior.* Defaults times a level that the fit finds first: drag {levels['drag level']:.3f} (blunt, slender), "
        f"lift {levels['lift level']:.3f} (Kutta); standard deviation half of that, a judgement: a part's share of the "
        "force may be wrong by half. (A factor of two lies in MuJoCo's convention: its drag is density x area x speed "
        "squared x coefficient without the 1/2, so a coefficient is half a textbook's.) Where other priors fit as well "
        "with other coefficients, the tows do not say which part feels a force; the prior that is used keeps it spread "
        "over the robot:"
    )


def _about_form(report: dict) -> str:
    return (
        f"*Errors of the form.* Beside its standard error a force may miss the model by "
        f"{100 * report['share_of_form']:.1f} % of what is typical of its direction, axis and speed: the share at which "
        "residuals and degrees of freedom agree. So every direction and axis weighs alike, however large its force; "
        "weighing newtons alike would lower the error along y and raise it along x."
    )


LIMITS = """What MuJoCo's form cannot do, whatever its coefficients:

- *Direction.* An ellipsoid's drag hardly falls between a tow across and one at 45 degrees; that of a bar does, by the
  cross-flow principle.
- *Configuration.* A rear leg in a front leg's wake feels less; MuJoCo's links know nothing of each other, and along y,
  legs turned about y have the same drag in every configuration.
- *Speed.* MuJoCo's forces grow with the speed squared; drag coefficients fall with the Reynolds number.

Not in the data at all: turning, moving legs, speeds above the tank's fastest, vertical motion, unsteadiness. Angular
drag in the scene is MuJoCo's default.
"""


def markdown(report: dict) -> str:
    """The whole page."""
    combinations = report["combinations"]
    seen = sum(row["strength"] > 1.0 for row in combinations)
    before, after = (report["errors"][model]["held_out"]["rmse"]["pooled"] for model in ("default", "identified"))
    left = report["left_out_configuration"]["all"]["rmse"]["pooled"]
    return "\n".join(
        [
            "# Real to sim: MuJoCo's water fitted to towing data",
            "",
            *_origin(report),
            f"**Held out: RMSE {_spread(before)} N before, {_spread(after)} N after; {_spread(left)} N for leg configurations "
            "that the fit never saw.**",
            "",
            "## Errors",
            "",
            *_errors(report),
            _about_errors(report),
            "",
            "![predicted against measured](before_after.svg)",
            "",
            "A leg configuration left out, the rest fitted (all tows but its own):",
            "",
            *_left_out(report),
            "## Coefficients",
            "",
            *_coefficients(report),
            _about_intervals(report),
            "",
            "![coefficients](coefficients.svg)",
            "",
            _about_prior(report),
            "",
            *_priors(report),
            _about_form(report),
            "",
            "## What the data cannot identify",
            "",
            *_unidentified(report),
            "A coefficient is called identified where the tows say more of it than the prior (its standard deviation falls below "
            "0.71 of the prior's, at most 5 % of whose variance lies where the tows leave no trace), its intervals end at no bound and the "
            "other priors above leave it within them.",
            "",
            f"The tows measure {seen} combinations of the {len(combinations)} coefficients that act (strength above 1: more than "
            "the prior; 0: no trace at all):",
            "",
            *_combinations(report),
            "Exact relations, a force of one at coefficient 1 made up of others (blunt and slender of a part raised together drag "
            "like a ball, the same from every side, and so do those of every other part):",
            "",
            *(f"- {name} = {_sum(members).removeprefix('+ ')}" for name, members in report["relations"].items()),
            "",
            "## What stays unexplained",
            "",
            "Measured less identified, mean and spread over leg configurations:",
            "",
            *_unexplained(report),
            "![residuals](residuals.svg)",
            "",
            LIMITS,
        ]
    )

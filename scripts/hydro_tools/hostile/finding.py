"""Hostile inputs of `hydro gap`: trials, nominals, effects of one's own, uncertainty, results of stages."""

import hashlib
import io
import json
import random
import shutil
import zipfile
from pathlib import Path

import numpy as np

from . import odd
from .bases import NOMINAL, Bases, csv_text, gap_flags, trial_arrays
from .running import Case

STAGES = (
    "find.json",
    "name.json",
    "add.json",
    "verify.json",
    "run.json",
    "timing.json",
    "candidate.xml",
    "patched.xml",
)


def _case(bases: Bases, folder: Path) -> Path:
    case = folder / "case"
    shutil.copytree(bases.gap, case)
    return case


def _find(bases: Bases, case: Path, folder: Path, trials: str = "trials", *flags: object) -> Case:
    return Case([bases.program, "gap", "find", *gap_flags(case, trials, folder / "out"), *flags])


def csv(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """A trial as a table: cells, names, times in another unit, torn lines."""
    case = _case(bases, folder)
    path = case / "trials/t0.csv"
    whole = path.read_text()
    change = rng.random()
    if change < 0.25:
        arrays = trial_arrays(rng.randrange(100))
        factor, shift = (
            rng.choice((1e3, 1e6, 1e9, 1e-3, 1e300, 60.0, -1.0, 1e-300, 1.0)),
            rng.choice((0.0, 1.7e9, 1e300, -1e18)),
        )
        for name in ("control_times", "sensordata_times"):
            arrays[name] = factor * arrays[name] + shift
        whole = csv_text(arrays)
    elif change < 0.85:
        whole = odd.text(rng, whole)
    else:
        whole = odd.torn(rng, whole.encode())
    odd.put(path, whole)
    return _find(bases, case, folder)


def npy(rng: random.Random, array: np.ndarray) -> bytes:
    """An array whose header says something else than its bytes are."""
    content = io.BytesIO()
    np.lib.format.write_array(content, array, allow_pickle=False)
    whole = content.getvalue()
    if rng.random() < 0.3:
        return odd.torn(rng, whole)
    shape = rng.choice(
        ("(1000000000000,)", "(4294967296, 4294967296)", "(18446744073709551615,)", "(-1,)", "(0, 5)", "((((", "()",
         "(1, 1, 1, 1, 1, 100)", "(" * 60_000, "(100000000, 2)", "(3.5,)", "(9223372036854775807, 2)", f"{array.shape}")
    )  # fmt: skip
    descr = rng.choice(
        ("<f8", "<f8", "<f8", "|O", "<f2", ">f8", "<U1000000000", "|V9223372036854775807", "<i8", "<c16")
    )
    text = f"{{'descr': '{descr}', 'fortran_order': {rng.choice(('False', 'True', '1'))}, 'shape': {shape}, }}".encode()
    text += b" " * (-(len(text) + 11) % 64) + b"\n"
    version = 2 if len(text) > 65_000 else 1
    length = rng.choice((len(text), len(text), 2**16 - 1)).to_bytes(2 if version == 1 else 4, "little")
    return b"\x93NUMPY" + bytes((version, 0)) + length + text + whole[128:]


def archive(rng: random.Random, arrays: dict[str, np.ndarray]) -> bytes:
    """An npz with one array wrong, torn, or a bomb."""
    file = io.BytesIO()
    wrong = rng.choice(list(arrays))
    bomb = rng.random() < 0.1
    with zipfile.ZipFile(file, "w") as packed:
        for name, array in arrays.items():
            content = io.BytesIO()
            if name == wrong and bomb:
                array = np.zeros((100_000, 300))
            elif name == wrong and rng.random() < 0.3:
                with np.errstate(all="ignore"):
                    array = array * rng.choice((1e3, 1e9, 1e300, np.nan, np.inf, 0.0))
            np.lib.format.write_array(content, array)
            method = zipfile.ZIP_DEFLATED if bomb or rng.random() < 0.2 else zipfile.ZIP_STORED
            whole = npy(rng, array) if name == wrong and not bomb and rng.random() < 0.7 else content.getvalue()
            packed.writestr(zipfile.ZipInfo(f"{name}.npy"), whole, compress_type=method)
        if rng.random() < 0.1:
            mapping = rng.choice(
                ('{"at": [0, [0]], "speed": [0, [18446744073709551615]]}', "[" * 100_000, "{}", '{"at": [0, []]}')
            )
            content = io.BytesIO()
            np.lib.format.write_array(content, np.array(mapping))
            packed.writestr("sensordata_signal_mapping.npy", content.getvalue())
    whole = file.getvalue()
    return odd.torn(rng, whole) if rng.random() < 0.25 else whole


def npz(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """A trial as an archive, or a recorded rollout."""
    if rng.random() < 0.3:
        rollouts = folder / "rollouts"
        shutil.copytree(bases.rollouts, rollouts)
        path = rollouts / "rollout-000.npz"
        path.write_bytes(archive(rng, dict(np.load(path))))
        return Case([bases.program, "inspect", rollouts])
    case = _case(bases, folder)
    (case / "archives/t0.npz").write_bytes(archive(rng, trial_arrays(rng.randrange(100))))
    return _find(bases, case, folder, "archives")


def rollouts(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """Values of rollouts.json."""
    out = folder / "rollouts"
    shutil.copytree(bases.rollouts, out)
    odd.in_json(rng, out / "rollouts.json", ("timestep", "sample_period", "duration", "rollouts"))
    if rng.random() < 0.7:
        return Case([bases.program, "inspect", out])
    return Case([bases.program, "simulate", "--rollouts", out, "--checkpoint", bases.checkpoints / "mlp"])


_DOCTYPES = (
    '<!DOCTYPE mujoco>', '<!DOCTYPE m [<!ENTITY a "b">]>', '<!DOCTYPE m SYSTEM "/etc/passwd">',
    '<!DOCTYPE m [<!ENTITY a "xxxxxxxxxx"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;">]>',
)  # fmt: skip


def nominal(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """The nominal MJCF: numbers, time steps, DOCTYPE, includes in circles, depth."""
    case = _case(bases, folder)
    path, change = case / "nominal.xml", rng.random()
    whole = NOMINAL
    if change < 0.15:
        whole = rng.choice(_DOCTYPES) + whole
    elif change < 0.35:
        whole = whole.replace(
            "0.005", rng.choice(("0", "-1", "1e-300", "1e-9", "nan", "inf", "1e300", "", "1e-5", "100")), 1
        )
    elif change < 0.45:
        file = rng.choice(("nominal.xml", "b.xml", "/dev/zero", "/etc/passwd", "..", "", "x" * 5000))
        (case / "b.xml").write_text('<mujocoinclude><include file="nominal.xml"/></mujocoinclude>')
        whole = whole.replace("<worldbody>", f'<include file="{file}"/><worldbody>')
    elif change < 0.5:
        depth = rng.choice((50, 1000, 100_000))
        whole = whole.replace("</worldbody>", '<body><geom size="1"/>' * depth + "</body>" * depth + "</worldbody>")
    elif change < 0.55:
        whole = "<a>" * 100_000
    elif change < 0.9:
        whole = odd.text(rng, whole)
    else:
        whole = odd.torn(rng, whole.encode())
    odd.put(path, whole)
    return _find(bases, case, folder)


def own_effect(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """The definition of an effect of one's own."""
    effects = folder / "effects.d"
    shutil.copytree(bases.own_effects, effects)
    path = effects / "tether.toml"
    whole = path.read_text()
    change = rng.random()
    if change < 0.15:
        deep = rng.choice(
            ("(" * 100_000, "-" * 100_000 + "x", "x" + "+x" * 100_000, "x" + "^2" * 10_000, "max(" * 5000)
        )
        whole = whole.replace('"z - anchor_z"', f'"{deep}"')
    elif change < 0.2:
        whole += "\n" + "[a" + ".a" * 50_000 + "]"
    elif change < 0.9:
        whole = odd.text(rng, whole)
    else:
        whole = odd.torn(rng, whole.encode())
    odd.put(path, whole)
    return Case([bases.program, "gap", "effects", "--effects", effects])


def uncertainty(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """nominal.toml."""
    case = _case(bases, folder)
    path = case / "uncertainty.toml"
    odd.put(path, odd.text(rng, path.read_text()))
    return _find(bases, case, folder, "trials", "--uncertainty", path)


def gap_flag(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """Values of the flags of `hydro gap`."""
    name = rng.choice(("holdout", "seed", "threads", "medium"))
    value = (
        rng.choice(odd.WORDS) if rng.random() < 0.5 else rng.choice(("0.5", "0.999999", "1e-300", "65535", "4", "air"))
    )
    flags = ["--model", bases.gap / "nominal.xml", "--trials", bases.gap / "trials", "--out", folder / "out"]
    return Case([bases.program, "gap", "find", *flags, f"--{name}={value}"])


def stage(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """A file of a finished stage, damaged, then read again."""
    out = folder / "out"
    shutil.copytree(bases.results, out)
    names = [name for name in STAGES if (out / name).is_file()]
    path = out / rng.choice(names)
    content = path.read_bytes()
    if path.suffix == ".json" and rng.random() < 0.7:
        path.write_bytes(odd.json_bytes(rng, json.loads(content)))
    else:
        path.write_bytes(odd.torn(rng, content))
    if path.name != "run.json" and rng.random() < 0.7:
        # The digest is right, so that more than the digest is tried.
        run = json.loads((out / "run.json").read_text())
        run["written"][path.name] = [hashlib.sha256(path.read_bytes()).hexdigest()]
        (out / "run.json").write_text(json.dumps(run))
    if rng.random() < 0.6:
        return Case([bases.program, "gap", "report", "--out", out])
    return Case([bases.program, "gap", "run", *gap_flags(bases.gap, "trials", out)])


KINDS = {
    "csv": csv, "npz": npz, "rollouts": rollouts, "nominal": nominal, "own effect": own_effect,
    "uncertainty": uncertainty, "gap flags": gap_flag, "stage": stage,
}  # fmt: skip

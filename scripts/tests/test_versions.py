"""One version: of the crates, the packages, the citation, the list of changes."""

import json
import re
import tomllib
import unittest

import hydro_mujoco
from hydro_tools.repository import ROOT


def table(path: str) -> dict:
    return tomllib.loads((ROOT / path).read_text(encoding="utf-8"))


class Versions(unittest.TestCase):
    def test_all_say_the_same(self):
        version = hydro_mujoco.__version__
        workspace = table("Cargo.toml")["workspace"]["package"]["version"]
        tools = table("scripts/pyproject.toml")["project"]
        locked = {entry["version"] for entry in table("Cargo.lock")["package"] if entry["name"].startswith("hydro")}
        cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.M)[1]
        first = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.M)[1]
        self.assertEqual({workspace, tools["version"], cited, first, *locked}, {version})
        self.assertIn(f"hydro-mujoco=={version}", tools["dependencies"])

    def test_the_wheel_asks_for_the_mujoco_that_the_library_accepts(self):
        """EQUAL of src/mujoco/ffi/api.rs, as pip's range."""
        equal = re.search(r"const EQUAL: .*?= \[&\[(.*?)\]\];", (ROOT / "src/mujoco/ffi/api.rs").read_text(), re.S)[1]
        numbers = [int(number.replace("_", "")) for number in equal.split(",")]
        oldest, newest = min(numbers), max(numbers)

        def readable(number: int) -> str:
            return f"{number // 1_000_000}.{number // 1000 % 1000}.{number % 1000}"

        (asked,) = [each for each in table("pyproject.toml")["project"]["dependencies"] if each.startswith("mujoco")]
        self.assertEqual(asked, f"mujoco>={readable(oldest)},<{readable(newest + 1)}")

    def test_locks_hold_what_is_asked_for_and_a_hash_of_each(self):
        """scripts/lock.sh was run after the last change of scripts/pyproject.toml."""
        extras = table("scripts/pyproject.toml")["project"]
        for lock in sorted((ROOT / "scripts/locks").glob("*.txt")):
            names = re.search(r"^-e scripts\[(.+)\]$", lock.with_suffix(".in").read_text(), re.M)[1].split(",")
            asked = extras["dependencies"] + sum((extras["optional-dependencies"][name] for name in names), [])
            asked = {re.sub(r"\[.*?\]", "", each) for each in asked if not each.startswith("hydro-")}
            entries = re.split(r"\n(?=\S)", re.sub(r"^#.*\n", "", lock.read_text(), flags=re.M))
            with self.subTest(lock.name):
                locked = {entry.split()[0] for entry in entries}
                self.assertEqual(asked - locked, set())
                for entry in entries:
                    self.assertRegex(entry, r"(?s)^[a-z0-9-]+==\S+.* --hash=sha256:[0-9a-f]{64}")

    def test_the_fuzzers_lock_knows_what_the_crates_need(self):
        """`cargo metadata --manifest-path fuzz/Cargo.toml` was run after the last change of a Cargo.toml."""
        locked = {of["name"]: of.get("dependencies", []) for of in table("fuzz/Cargo.lock")["package"]}
        for place in (".", *sorted(f"crates/{path.name}" for path in (ROOT / "crates").iterdir())):
            manifest = table(f"{place}/Cargo.toml")
            needed = {name for name, of in manifest["dependencies"].items() if not of.get("optional")}
            # A lock with two versions of a crate names which.
            found = {name.split()[0] for name in locked.get(manifest["package"]["name"], needed)}
            with self.subTest(place):
                self.assertEqual(needed - found, set())

    def test_every_released_card_has_the_digest_that_finds_a_flipped_bit(self):
        cards = sorted((ROOT / "models").glob("*/card.json"))
        self.assertGreater(len(cards), 5)
        for card in cards:
            with self.subTest(card.parent.name):
                digests = json.loads(card.read_text())
                for name in ("card_sha256", "weights_sha256"):
                    self.assertRegex(digests[name], "^[0-9a-f]{64}$")


if __name__ == "__main__":
    unittest.main()

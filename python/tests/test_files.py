"""Files are written whole, and through no link."""

import tempfile
import unittest
from pathlib import Path
from unittest import mock

from hydro_mujoco.recording import files


class Writing(unittest.TestCase):
    def test_a_link_where_the_file_is_made_is_refused_and_its_target_left_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            victim, path = Path(folder, "victim"), Path(folder, "card.json")
            victim.write_text("precious")
            with mock.patch("secrets.token_hex", return_value="known"):
                path.with_name("card.json.known.tmp").symlink_to(victim)
                with self.assertRaises(FileExistsError):
                    files.write_beside(path, b"new")
            self.assertEqual(victim.read_text(), "precious")
            files.write_beside(path, b"new")
            self.assertEqual(path.read_bytes(), b"new")


if __name__ == "__main__":
    unittest.main()

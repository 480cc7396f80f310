# SPDX-License-Identifier: MIT
"""The built program from end to end, as a person or a script uses it: what the tests of this folder stand on."""
import atexit
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

FIRN = str(Path(sys.argv[1] if len(sys.argv) > 1 else "build/firn").resolve())
PATIENCE = float(os.environ.get("FIRN_TEST_PATIENCE", "1"))  # longer for builds with sanitizers

SCENES = Path(__file__).resolve().parents[2] / "scenes"
SCENE = Path(__file__).with_name("tiny.toml").read_text(encoding="utf-8")
# Some tenths of a second a frame: long enough to be interrupted in one.
LARGER = ["--set", "image.samples=24", "--set", "image.width=320", "--set", "image.height=240"]
# Of the scene as it is; as long with sanitizers as without.
LONG = ["--set", f"image.samples={int(300 / PATIENCE)}"]


class ProgramTest(unittest.TestCase):
    kept = None  # a folder of runs that several tests start from, while this process lasts
    known = {}  # the runs in it, by the words that made them

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="firn-test-")
        self.addCleanup(self.folder.cleanup)
        self.here = Path(self.folder.name)
        self.scene = self.write("tiny.toml", SCENE)

    def write(self, name, text):
        (self.here / name).write_text(text)
        return name

    def firn(self, *words, code=0, limit=None, stdin=subprocess.DEVNULL):
        done = subprocess.run([FIRN, *words], cwd=self.here, capture_output=True, text=True, timeout=120, preexec_fn=limit,
                              stdin=stdin)
        self.assertEqual(done.returncode, code, f"firn {' '.join(words)}\n{done.stdout}{done.stderr}")
        return done

    def start_with(self, run, *words):
        """A run of the scene that `words` make, copied from one that is made once for all tests."""
        if words not in self.known:
            if not self.kept:
                ProgramTest.kept = Path(tempfile.mkdtemp(prefix="firn-test-"))
                atexit.register(shutil.rmtree, self.kept, ignore_errors=True)
                (self.kept / "tiny.toml").write_text(SCENE)
            self.known[words] = self.kept / str(len(self.known))
            self.firn(words[0], str(self.kept / "tiny.toml"), "--out", str(self.known[words]), *words[1:])
        shutil.copytree(self.known[words], self.here / run)

    def manifest(self, run):
        return json.loads(self.firn("info", run, "--json").stdout)

    def hashes(self, run):
        """Everything that must not change: the bits of snow and light and of the files of every frame."""
        frames = self.manifest(run)["frames"]
        return [(f["frame"], f["particles_hash"], f["picture_hash"], f["files"]) for f in frames]

    def names(self, folder):
        return sorted(path.name for path in (self.here / folder).iterdir())

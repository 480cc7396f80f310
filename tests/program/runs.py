# SPDX-License-Identifier: MIT
"""What a run, a rendering and `firn info` leave and say, and when a start is refused."""
import json
import re
import resource
import subprocess

from program import FIRN, ProgramTest, SCENE


class Runs(ProgramTest):
    def test_a_run_leaves_frames_movie_manifest_metrics_scene_log_and_trace(self):
        done = self.firn("run", self.scene)
        self.assertEqual(done.stdout, "out/tiny\n")
        self.assertIn("particle-steps", done.stderr)
        run = self.here / "out/tiny"
        self.assertEqual(self.names("out/tiny/frames"), [f"{k:04}.png" for k in range(6)])
        self.assertTrue((run / "movie.webp").exists() or (run / "movie.mp4").exists())
        manifest = self.manifest("out/tiny")
        self.assertEqual(manifest["status"], "complete")
        self.assertEqual(manifest["seed"], 3)
        self.assertAlmostEqual(manifest["frames"][5]["metrics"]["time_s"], 5 * 0.5 / 24, 12)
        self.assertEqual(len((run / "metrics.csv").read_text().splitlines()), 7)
        self.assertIn("firn", (run / "log.txt").read_text())
        events = json.loads((run / "trace.json").read_text())["traceEvents"]
        self.assertEqual(sum(event["ph"] == "X" for event in events), 18)

    def test_a_run_repeated_from_its_resolved_scene_gives_the_same_bits(self):
        self.firn("run", self.scene, "--out", "a", "--set", "snow.ball.radius=0.09", "--seed", "11")
        self.firn("run", "a/scene.resolved.toml", "--out", "b")
        self.assertEqual(self.manifest("b")["seed"], 11)
        self.assertEqual(self.hashes("a"), self.hashes("b"))

    def test_each_run_takes_a_folder_of_its_own(self):
        for expected in ("out/tiny", "out/tiny-2", "out/tiny-3"):
            self.assertEqual(self.firn("simulate", self.scene, "--quiet").stdout.strip(), expected)

    def test_quiet_says_nothing(self):
        self.assertEqual(self.firn("run", self.scene, "--quiet").stderr, "")

    def test_simulate_then_render_gives_the_pictures_of_run(self):
        self.firn("run", self.scene, "--out", "a")
        self.firn("simulate", self.scene, "--out", "b")
        self.assertEqual(self.names("b/frames"), [])
        self.firn("render", "b", "--frames", "2-3")
        self.assertEqual(self.names("b/frames"), ["0002.png", "0003.png"])
        self.firn("render", "b")
        self.firn("render", "b", "--out", "c", "--set", "image.samples=1")
        for frame in range(6):
            name = f"frames/{frame:04}.png"
            self.assertEqual((self.here / "a" / name).read_bytes(), (self.here / "b" / name).read_bytes())
            self.assertNotEqual((self.here / "a" / name).read_bytes(), (self.here / "c" / name).read_bytes())

    def test_render_of_a_scene_shows_its_initial_state_or_the_frames_asked_for(self):
        self.firn("run", self.scene, "--out", "a")
        self.firn("render", self.scene, "--out", "b")
        self.firn("render", self.scene, "--out", "c", "--frames", "3-4")
        self.assertEqual(self.hashes("b"), self.hashes("a")[:1])
        self.assertEqual(self.hashes("c"), self.hashes("a")[3:5])

    def test_check_prints_what_a_scene_costs_and_writes_nothing(self):
        text = self.firn("check", self.scene).stdout
        for word in ("particles", "grid", "blocks", "time step", "limited by", "steps a frame", "memory"):
            self.assertIn(word, text)
        self.assertEqual(self.names("."), ["tiny.toml"])

    def test_info_version_and_params_print_on_stdout(self):
        self.assertIn("x86-64", self.firn("info").stdout)
        self.assertRegex(self.firn("--version").stdout, r"^firn \d+\.\d+\.\d+ ")
        self.assertIn("young_modulus", self.firn("params", "snow").stdout)
        self.assertNotIn("young_modulus", self.firn("params", "camera").stdout)


class Refusals(ProgramTest):
    def test_a_hint_can_be_typed_whatever_the_folder_is_called(self):
        for folder in ("-x", "a b", "it's"):
            self.firn("run", self.scene, f"--out={folder}", "--frames", "0-1")
            said = self.firn("run", self.scene, f"--out={folder}", code=2).stderr
            typed = re.search(r"continue it with '(firn resume .*)', replace", said)[1]
            subprocess.run(["sh", "-c", typed.replace("firn", f"'{FIRN}'", 1)], cwd=self.here, check=True, capture_output=True)

    def refused(self, code, *words):
        """The one line of the refusal; nothing may be left behind."""
        before = self.names(".")
        done = self.firn(*words, code=code)
        self.assertEqual(self.names("."), before)
        self.assertEqual(done.stdout, "")
        self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        return done.stderr

    def test_a_typo_in_a_scene_names_its_place_and_what_was_meant(self):
        self.write("typo.toml", SCENE.replace("radius", "radiu"))
        self.assertRegex(self.refused(2, "run", "typo.toml"), r"^typo\.toml:\d+:\d+: .*radius")

    def test_scene_errors_found_late_leave_no_folder(self):
        self.write("tiny_ball.toml", SCENE.replace("radius = 0.1", "radius = 0.0"))
        self.refused(2, "run", "tiny_ball.toml")
        self.write("mesh.toml", re.sub(r'shape = "ball"\n.*\n.*\n', 'shape = "mesh"\nfile = "none.obj"\n', SCENE))
        self.assertIn("none.obj", self.refused(4, "run", "mesh.toml"))

    def test_wrong_words_on_the_command_line_are_usage_errors(self):
        self.refused(2, "run", self.scene, "--fames", "0-1")
        self.refused(2, "run", self.scene, "--frames", "4-2")
        self.refused(2, "run", self.scene, "--frames", "2-9")
        self.refused(2, "run", self.scene, "--set", "image.width")
        self.refused(2, "run", self.scene, "--threads", "0")
        self.refused(2, "run", self.scene, "--isa", "x86-64-v9")
        self.refused(2, "jog", self.scene)
        self.refused(2, "run")

    def test_a_missing_scene_is_a_file_error(self):
        self.assertIn("none.toml", self.refused(4, "run", "none.toml"))

    def test_a_folder_that_holds_a_run_is_refused_and_overwritten_only_when_asked(self):
        self.firn("run", self.scene, "--out", "a")
        refusal = self.refused(2, "run", self.scene, "--out", "a")
        self.assertIn("firn resume a", refusal)
        self.assertIn("--overwrite", refusal)
        self.firn("run", self.scene, "--out", "a", "--overwrite", "--frames", "0-1")
        self.assertEqual(self.names("a/frames"), ["0000.png", "0001.png"])

    def test_a_folder_that_cannot_be_written_is_a_file_error(self):
        self.write("file", "")
        self.assertIn("file/out", self.refused(4, "run", self.scene, "--out", "file/out"))

    def test_resume_and_render_want_a_run(self):
        self.refused(4, "resume", "nothing")
        self.firn("run", self.scene, "--out", "a")
        self.assertIn("particles", self.refused(2, "render", "a"))

    def test_a_full_disk_ends_the_run_with_a_file_error_and_keeps_what_was_finished(self):
        small = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))
        done = self.firn("run", self.scene, "--out", "a", "--set", "output.formats=['png','pfm']", "--set",
                         "image.width=100", "--set", "image.height=100", code=4, limit=small)
        self.assertIn("0000.pfm", done.stderr)
        self.assertEqual(self.manifest("a")["status"], "failed")
        self.assertFalse([name for name in self.names("a/frames") if name.endswith(".part")])

    def test_an_unstable_simulation_keeps_the_good_frames_and_exits_with_3(self):
        self.write("wild.toml", SCENE.replace("seed = 3", "seed = 3\ndt = 8e-3"))
        done = self.firn("run", "wild.toml", "--out", "a", "--force", code=3)
        self.assertRegex(done.stderr, r"step \d+")
        manifest = self.manifest("a")
        self.assertEqual(manifest["status"], "failed")
        self.assertEqual(self.names("a/frames"), [f"{f['frame']:04}.png" for f in manifest["frames"]])
        self.assertTrue(manifest["frames"])

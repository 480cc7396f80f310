# SPDX-License-Identifier: MIT
"""The command line and what is said on it."""
import fcntl
import os
import pty
import re
import struct
import subprocess
import termios

from program import FIRN, ProgramTest, SCENE


class Words(ProgramTest):
    def refusal(self, *words, code=2, **options):
        done = self.firn(*words, code=code, **options)
        self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        return done.stderr

    def test_a_wrong_word_names_what_was_meant(self):
        self.firn("run", self.scene, "--out", "a", "--frames", "0")
        for words, meant in ((["runn", self.scene], "'run'"), (["rnder"], "'render'"), (["Resume", "a"], "'resume'"),
                             ([self.scene], f"'firn run {self.scene}'"), (["./none.toml"], "'firn run ./none.toml'"),
                             (["a"], "'firn resume a'"), (["run", self.scene, "--quik"], "'--quick'"),
                             (["run", "--ouput", "b", self.scene], "'--out'"), (["check", self.scene, "--frames", "0"], "--frames"),
                             (["run", self.scene, "--frame=1"], "'--frames'"), (["--quick", "run", self.scene], "firn COMMAND --quick"),
                             (["--hlep"], "'--help'"), (["--quik", "run", self.scene], "'--quick'"), (["--xyzzy"], "no option '--xyzzy'"),
                             (["run", self.scene, "more"], "'more'"), (["run", "--", self.scene, "more"], "'more'"),
                             (["run", "--", self.scene, "--quick"], "does not take '--quick' too"), (["xyzzy"], "simulate, render"),
                             (["run", self.scene, "--frames", "4-2"], "2-4"), (["params", "raduis"], "'radius'"),
                             (["run", self.scene, "--set", "image.widht=3"], "'width'")):
            self.assertIn(meant, self.refusal(*words), words)

    def test_what_was_typed_comes_back_in_one_line(self):
        self.write("odd.toml", '"a\\nb" = 1\n')
        for words, code in ((["check", "odd.toml"], 2), (["check", self.scene, "--set", "image.width=3\ny=4"], 2), (["ru\nn"], 2),
                            (["run", self.scene, "--fa\nmes"], 2), (["params", "qw\x1b[31m\n"], 2), (["check", "no\nfile"], 4)):
            self.assertNotRegex(self.refusal(*words, code=code).strip(), r"[\x00-\x1f\x7f]")

    def test_a_folder_that_is_no_run_is_told_by_what_it_is(self):
        self.firn("run", self.scene, "--out", "a", "--frames", "0")
        for command in ("resume", "info"):
            self.assertIn("no such folder", self.refusal(command, "none", code=4))
            self.assertIn("not a folder", self.refusal(command, self.scene, code=4))
            self.assertIn("not a folder", self.refusal(command, "a/run.json", code=4))
            self.assertIn("no run.json", self.refusal(command, "a/frames", code=4))

    def test_empty_words_are_not_taken_for_none(self):
        for words in (["info", ""], ["info", "", "--json"], ["params", ""], ["check", ""], ["render", ""], ["resume", ""], ["run", ""]):
            self.assertIn("empty word", self.refusal(*words))
        self.assertIn("--frames", self.refusal("run", self.scene, "--frames", ""))
        self.assertIn("--out", self.refusal("run", self.scene, "--out", ""))
        self.assertIn("no format", self.refusal("run", self.scene, "--set", "output.formats=[]"))
        self.assertIn("'image'", self.refusal("check", self.scene, "--set", "image[3].width=10"))
        self.assertIn("'name'", self.refusal("check", self.scene, "--set", "name[7]=x"))

    def test_a_movie_that_cannot_be_encoded_is_refused_before_its_frames_are_made(self):
        without = os.environ | {"PATH": "/nowhere"}
        done = subprocess.run([FIRN, "run", self.scene, "--set", "image.width=16384", "--set", "image.height=1"], cwd=self.here, env=without,
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("16383", done.stderr)

    def test_a_seed_out_of_range_names_the_range(self):
        for seed in ("-1", "9223372036854775808", "1e3", "0x10", "seven", "1 2", "+1"):
            for words in (["--seed", seed], [f"--seed={seed}"]):
                self.assertIn("0 to 9223372036854775807", self.refusal("check", self.scene, *words), seed)

    def test_help_is_a_command_too(self):
        self.assertEqual(self.firn("help").stdout, self.firn("--help").stdout)
        for command in ("run", "simulate", "render", "resume", "check", "params", "info"):
            self.assertEqual(self.firn("help", command).stdout, self.firn(command, "--help").stdout)

    def test_params_finds_words_in_names_and_meanings(self):
        self.assertIn("camera.aperture", self.firn("params", "aperture").stdout)
        self.assertIn("light.type", self.firn("params", "preetham").stdout)
        self.refusal("params", "qwertyuiop")

    def test_a_scene_that_cannot_be_read_says_why(self):
        (self.here / "folder").mkdir()
        self.firn("run", self.scene, "--out", "a", "--frames", "0")
        os.mkfifo(self.here / "pipe.toml")
        for name, why in (("none.toml", "No such file"), ("folder", "this is a folder"), ("a", "a/scene.resolved.toml"),
                          ("pipe.toml", "pipe"), ("/dev/zero", "device"), ("/dev/null", "device")):
            self.assertIn(why, self.refusal("check", name, code=4), name)
        (self.here / "secret.toml").write_text(SCENE)
        (self.here / "secret.toml").chmod(0)
        if os.geteuid() != 0:
            self.assertIn("ermission denied", self.refusal("check", "secret.toml", code=4))

    def test_a_scene_is_read_from_the_standard_input(self):
        with open(self.here / self.scene, encoding="utf-8") as file:
            self.firn("run", "-", "--out", "a", "--frames", "0-1", stdin=file)
        self.firn("run", self.scene, "--out", "b", "--frames", "0-1")
        self.assertEqual(self.hashes("a"), self.hashes("b"))
        self.write("wrong.toml", SCENE.replace("radius", "radiu"))
        with open(self.here / "wrong.toml", encoding="utf-8") as file:
            self.assertRegex(self.refusal("check", "-", stdin=file), r"^stdin:\d+:\d+: .*radius")
        with open("/dev/zero", encoding="utf-8") as file:
            self.assertIn("64 MiB", self.refusal("check", "-", code=4, stdin=file))

    def test_a_file_of_a_scene_that_is_none_says_what_it_is(self):
        os.mkfifo(self.here / "pipe")
        (self.here / "folder").mkdir()
        forms = ('[[object]]\nshape = "mesh"\nfile = "{}"\n', '[[object]]\nshape = "height_field"\nextent = [1, 1, 1]\nfile = "{}"\n',
                 '[[surface]]\nname = "s"\ntexture = "{}"\n', '[[light]]\ntype = "image"\nradiance = [1, 1, 1]\nfile = "{}"\n')
        for form in forms:
            for name, what, code in (("", "names no file", 2), ("folder", "folder", 4), (".", "folder", 4), ("pipe", "pipe", 4),
                                     ("/dev/zero", "device", 4), ("absent", "no such file", 4)):
                self.write("odd.toml", SCENE + "\n" + form.format(name))
                for command in ("check", "run"):
                    self.assertRegex(self.firn(command, "odd.toml", code=code).stderr, rf"^odd.toml:\d+:\d+: .*{what}")

    def test_keys_of_endless_depth_are_refused_in_a_line(self):
        for text in ("a" + ".a" * 20_000 + " = 1", "[a" + ".a" * 20_000 + "]", "x = " + "{a=" * 20_000, "x = " + "[" * 20_000):
            self.write("deep.toml", text)
            self.assertRegex(self.refusal("check", "deep.toml"), r"^deep\.toml:1:\d+: ")
        self.refusal("check", self.scene, "--set", "a" + ".a" * 20_000 + "=1")
        self.refusal("check", self.scene, "--set", "image.width={" + "a." * 20_000 + "a=1}")

    def test_output_that_cannot_be_written_is_a_file_error(self):
        for words in (["check", self.scene], ["params"], ["info"], ["--help"], ["run", self.scene, "--frames", "0", "--quiet"]):
            with open("/dev/full", "w", encoding="utf-8") as full:
                done = subprocess.run([FIRN, *words], cwd=self.here, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
            self.assertEqual(done.returncode, 4, words)
            self.assertIn("standard output", done.stderr)

    def test_with_streams_closed_at_the_start_nothing_lands_in_a_file_of_the_run(self):
        self.firn("run", self.scene, "--out", "whole", "--frames", "0-1")
        for run, closed in (("in", "<&-"), ("out", ">&-"), ("error", "2>&-"), ("all", "<&- >&- 2>&-")):
            subprocess.run(["bash", "-c", f'"$0" run {self.scene} --out {run} --frames 0-1 {closed}', FIRN], cwd=self.here, timeout=60,
                           check=True, capture_output=True)
            self.assertEqual(self.hashes(run), self.hashes("whole"))
            for name in ("frames/0000.png", "frames/0001.png", "metrics.csv", "scene.resolved.toml"):
                self.assertEqual((self.here / run / name).read_bytes(), (self.here / "whole" / name).read_bytes(), closed)

    def test_progress_fits_into_the_terminal(self):
        for columns in (20,):
            ours, theirs = pty.openpty()
            fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
            with subprocess.Popen([FIRN, "run", self.scene, "--overwrite", "--out", "a", "--set", "image.samples=64"], cwd=self.here, stderr=theirs,
                                  stdout=subprocess.DEVNULL) as process:
                os.close(theirs)
                said = b""
                try:
                    while chunk := os.read(ours, 4096):
                        said += chunk
                except OSError:  # the other end is closed
                    pass
            os.close(ours)
            self.assertEqual(process.returncode, 0)
            drawn = re.findall(r"\r\x1b\[K([^\r\n]*)(?=\r\x1b)", said.decode())
            self.assertTrue(drawn)
            self.assertLess(max(map(len, drawn)), columns)

    def test_names_may_be_of_any_script(self):
        self.write("schöner schnee.toml", SCENE.replace('name = "tiny"', "").replace('"ball"', '"雪"', 1))
        self.assertEqual(self.firn("run", "schöner schnee.toml", "--frames", "0-1", "--set", "snow.雪.radius=0.08").stdout, "out/schöner_schnee\n")
        self.firn("resume", "out/schöner_schnee")

    def test_numbers_that_no_float_holds_are_refused(self):
        for key in ("snow.velocity", "simulation.gravity"):
            for number in ("1e300", "-1e300", "1e-300"):
                self.assertIn("single precision", self.refusal("check", self.scene, "--set", f"{key}=[0,{number},0]"))
        self.assertIn("single precision", self.refusal("check", self.scene, "--set", "snow.density=1e-300"))

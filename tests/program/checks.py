# SPDX-License-Identifier: MIT
"""What `firn check` says before anything is run, beside what runs then take."""
import os
import re
import shutil
import subprocess
import time
import unittest
from pathlib import Path

from program import FIRN, PATIENCE, ProgramTest, SCENE, SCENES


GROUND = "[ground]\n"
BALL = """[[snow]]
name = "{name}"
shape = "ball"
center = {center}
radius = 0.1
particles_per_cell = 8
{more}
"""


def scene_of(bodies, rest=GROUND, position="[0.0, 0.6, 2.0]", target="[0.0, 0.1, 0.0]"):
    """Balls of 0.1 m: (name, centre, further lines)."""
    head = f"""[simulation]
dx = 0.025
[time]
frames = 2
[camera]
position = {position}
target = {target}
[image]
width = 64
height = 48
samples = 1
"""
    return head + rest + "".join(BALL.format(name=name, center=center, more=more) for name, center, more in bodies)


class Checks(ProgramTest):
    """What `firn check` says before anything is run."""

    def check(self, text, *words):
        done = self.firn("check", self.write("checked.toml", text), *words)
        return done.stdout, done.stderr

    def test_the_box_of_each_body_and_what_the_camera_sees(self):
        said, warned = self.check(scene_of([("low", [-0.3, 0.1, 0], ""), ("high", [0.3, 0.1, 0], "")]))
        self.assertEqual(warned, "")
        boxes = re.findall(r"x (\S+) to (\S+), y (\S+) to (\S+), z (\S+) to (\S+) m", said)
        self.assertEqual(len(boxes), 2)
        for box, x in zip(boxes, (-0.3, 0.3)):
            for value, exact in zip(map(float, box), (x - 0.1, x + 0.1, 0, 0.2, -0.1, 0.1)):
                self.assertAlmostEqual(value, exact, delta=0.015)
        seen = {name: float(part) for name, part in re.findall(r"([^,]+?) ([\d.e+-]+) %,?", re.search(r"camera sees\s+(.*)", said)[1])}
        seen = {name.strip(): part for name, part in seen.items()}
        self.assertAlmostEqual(seen["low"], seen["high"], delta=0.2 * seen["low"])
        self.assertAlmostEqual(sum(seen.values()), 100, delta=2)

    def test_check_refuses_what_run_refuses_in_the_same_words(self):
        self.write("small.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        self.write("huge.obj", "")
        os.truncate(self.here / "huge.obj", 1 << 42)
        self.write(self.scene, SCENE + '[[object]]\nshape = "mesh"\nfile = "small.obj"\n')
        has_exr = "exr" in self.firn("info").stdout
        for words, code, said in ((["--set", "output.formats=['exr']"], 2, None if has_exr else "OpenEXR"),
                                  (["--set", "image.width=32768", "--set", "image.height=32768"], 2, "pixels"),
                                  (["--set", "snow.mu=1e-15", "--set", "snow.lambda=1e5"], 2, "no finite speed"),
                                  (["--set", "snow.mu=1e-12", "--set", "snow.lambda=1e5"], 2, "no finite speed"),
                                  (["--set", "simulation.particles_across=9000"], 2, "GiB"), (["--set", "simulation.dt=1"], 2, "stable bound"),
                                  (["--set", "image.width=20000"], 2, None if shutil.which("ffmpeg") else "16383"),
                                  (["--set", f"name={'x' * 201}"], 2, "200 bytes"), (["--set", f"snow.name={'x' * 300}"], 2, "200 bytes"),
                                  (["--set", "object.file=huge.obj"], 4, "memory of the machine"),
                                  (["--set", "snow.radius=-1"], 2, "radius")):
            if said is None:
                continue
            words = [self.scene, *words]
            checked, run = (self.firn(name, *words, *more, code=code) for name, more in (("check", []), ("run", ["--out", "a"])))
            self.assertEqual((checked.stderr, checked.returncode), (run.stderr, run.returncode))
            self.assertIn(said, checked.stderr)
            self.assertFalse((self.here / "a").exists())

    def test_cameras_from_everywhere(self):
        far = [["--set", f"camera.aperture={value}"] for value in ("5e5", "1e6", "1e7", "1e9", "1e11")]
        for place in ("[1e4,1e4,1e4]", "[1e7,1e7,1e7]", "[1e9,0,0]", "[0,1e11,0]"):
            far += [["--set", f"camera.position={place}", "--set", f"camera.fov={fov}"] for fov in ("1e-7", "1e-4", "60")]
        for words in far:
            for snow in ("smooth", "spheres"):
                self.firn("check", self.scene, *words, "--set", f"image.snow={snow}", "--set", "camera.up=[0,0,1]")

    def test_snow_that_nobody_sees(self):
        left, right, behind = ("left", [-0.3, 0.1, 0], ""), ("right", [0.3, 0.1, 0], ""), ("behind", [0, 0.1, 4], "")
        wall = '[[object]]\nshape = "box"\ncenter = [-0.3, 0.3, 0.4]\nsize = [0.5, 0.8, 0.05]\n'
        for text, unseen in ((scene_of([left, right]), []), (scene_of([left, right, behind]), ["behind"]),
                             (scene_of([left, right], GROUND + wall), ["left"]),
                             (scene_of([left, right], position="[0.0, 0.6, -2.0]", target="[0.0, 0.6, -9.0]"), ["left", "right"]),
                             (scene_of([left, ("far", [90, 0.1, 0], "")]), ["far"])):
            _, warned = self.check(text)
            self.assertEqual(re.findall("warning: the camera sees nothing of snow '(.*?)'", warned), unseen, warned)
            if unseen:
                self.assertRegex(warned, r"checked\.toml:\d+:\d+: warning")

    def test_snow_that_floats(self):
        thrown, flying = "velocity = [1.0, 0.0, 0.0]", "terminal_velocity = 1.0"
        for bodies, rest, floating in (
                ([("a", [0, 0.1, 0], "")], GROUND, []), ([("a", [0, 0.3, 0], "")], GROUND, ["a"]), ([("a", [0, 30, 0], "")], GROUND, ["a"]),
                ([("a", [0, 0.3, 0], thrown)], GROUND, []), ([("a", [0, 0.3, 0], flying)], GROUND, []),
                ([("a", [0, 0.1, 0], ""), ("b", [0, 0.3, 0], "")], GROUND, []),
                ([("b", [0, 0.5, 0], ""), ("a", [0, 0.3, 0], "")], GROUND, ["b", "a"]),
                ([("a", [0, 0.1, 0], "")], "", ["a"]),
                ([("a", [0, 0.3, 0], "")], '[[collider]]\nname = "table"\nshape = "box"\ncenter = [0, 0.1, 0]\nsize = [1, 0.2, 1]\n', []),
                ([("a", [2, 0.3, 0], "")], '[[collider]]\nname = "table"\nshape = "box"\ncenter = [0, 0.1, 0]\nsize = [1, 0.2, 1]\n', ["a"])):
            _, warned = self.check(scene_of(bodies, rest))
            self.assertEqual(re.findall("snow '(.*?)' floats", warned), floating, f"{bodies} {rest} {warned}")
        _, warned = self.check(scene_of([("a", [0, 0.3, 0], "")]), "--set", "simulation.gravity=[0.0, 0.0, 0.0]")
        self.assertNotIn("floats", warned)

    def test_snow_under_the_terrain(self):
        under = "allow_overlap = true"
        hill = '[[object]]\nshape = "box"\ncenter = [0, -2, 0]\nsize = [9, 4, 9]\n'
        hidden = hill.replace("object", "collider") + 'name = "hill"\nvisible = false\n'
        glass = hill.replace("object", "collider") + 'name = "hill"\nsurface = "ice"\n[[surface]]\nname = "ice"\ntype = "dielectric"\n'
        for bodies, rest, buried in (([("a", [0, -1, 0], under)], glass, "collider 'hill'"), ([("a", [0, -1, 0], under)], hidden, "collider 'hill'"), ([("a", [0, -1, 0], under)], hidden.replace("false", "true"), "collider 'hill'"),
                                     ([("a", [0, 0.1, 0], "")], hidden, None), ([("a", [0, -5, 0], under)], GROUND, "the ground"), ([("a", [0, -0.2, 0], under)], GROUND, "the ground"),
                                     ([("a", [0, 0.05, 0], under)], GROUND, "the ground"), ([("a", [0, 0.1, 0], "")], GROUND, None),
                                     ([("a", [0, -1, 0], "")], hill, "object[0]"), ([("a", [0, 0.1, 0], "")], hill, None)):
            _, warned = self.check(scene_of(bodies, rest))
            told = re.findall(r"warning: (\S+) % of snow 'a' lies under the surface of (.*)", warned)
            self.assertEqual([solid for _, solid in told], [buried] if buried else [], warned)
            if buried and bodies[0][1][1] < -0.15:
                self.assertEqual(told[0][0], "100")

    def test_of_many_warnings_the_first_are_printed_and_the_rest_counted(self):
        for count in (10, 11, 40):
            _, warned = self.check(scene_of([(f"s{i}", [0.3 * i, 0.5, 5], "") for i in range(count)]))
            for one, many in (("floats", "float"), ("sees nothing of", "are not seen in frame 0")):
                self.assertEqual(warned.count(one), min(count, 10), warned)
                total = f"checked.toml: warning: of {count} bodies of snow {count} {many}\n"
                self.assertEqual(warned.count(total), int(count > 10), warned)


class Estimates(ProgramTest):
    """What `firn check` foretells, beside what runs then took."""

    NAMES = ("broken_snowball_2d", "column_collapse", "cornell_box", "snowball_drop", "two_snowballs")

    def most_memory(self, *words, preload=None):
        """MiB that firn held at most."""
        most, environment = 0, os.environ | ({"LD_PRELOAD": str(preload)} if preload else {})
        with subprocess.Popen([FIRN, *words], cwd=self.here, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment) as process:
            while process.poll() is None:
                status = Path(f"/proc/{process.pid}/status").read_text()
                told = re.search(r"VmHWM:\s+(\d+) kB", status)
                most = max(most, int(told[1]) / 1024 if told else 0)
                time.sleep(0.003)
        self.assertEqual(process.returncode, 0, words)
        return most

    @unittest.skipIf(PATIENCE > 1, "sanitizers take memory of their own")
    def test_memory_and_steps_are_as_foretold(self):
        for name in self.NAMES:
            scene = str(SCENES / f"{name}.toml")
            size = ["--quick", "--set", "image.samples=2"]
            said = self.firn("check", scene, *size).stdout
            start, low, high = map(float, re.search(r"([\d.]+) MiB at frame 0, at most ([\d.]+) MiB to ([\d.]+) MiB", said).groups())
            most = self.most_memory("render", scene, *size, "--frames", "0", "--out", f"{name}0")
            self.assertAlmostEqual(start / most, 1, delta=0.15, msg=f"{name}: told {start} MiB at frame 0, took {most}")
            self.assertLessEqual(high / low, 1.6)
            most = self.most_memory("run", scene, *size, "--set", "output.movie=false", "--out", name)
            self.assertTrue(low <= most <= high, f"{name}: told {low} to {high} MiB, took {most}")
            least, last = (int(n.replace(",", "")) for n in re.search(r"([\d,]+) to ([\d,]+) in all", said).groups())
            self.assertTrue(least <= self.manifest(name)["frames"][-1]["metrics"]["steps"] <= last, said)

    @unittest.skipIf(PATIENCE > 1, "sanitizers take memory of their own")
    def test_frames_do_not_pile_up_before_a_slow_disk(self):
        """Each flush to the disk takes 80 ms, several times as long as a frame is simulated and traced."""
        self.write("slow.c", "#include <unistd.h>\n#include <sys/syscall.h>\nint fsync(int fd) { usleep(80000); return syscall(SYS_fsync, fd); }\n")
        subprocess.run(["cc", "-shared", "-fPIC", "-o", "slow.so", "slow.c"], cwd=self.here, check=True)
        words = ["run", self.scene, "--set", "simulation.particles_across=60", "--set", "time.fps=2000", "--set", "output.particles=true", "--set", "output.movie=false",
                 "--set", "output.checkpoint_every=0"]
        few, many = ["--set", "time.frames=4"], ["--set", "time.frames=24"]
        quick = self.most_memory(*words, *many, "--out", "quick")
        for frames, slots, out in ((few, [], "few"), (many, [], "many"), (many, ["--no-overlap"], "one")):
            begin = time.monotonic()
            most = self.most_memory(*words, *frames, *slots, "--out", out, preload=self.here / "slow.so")
            self.assertGreater(time.monotonic() - begin, 0.08 * 3 * (4 if frames is few else 24))
            self.assertLess(most / quick, 1.1, f"{out}: {most} MiB, {quick} with the disk as it is")
        particles = (self.here / "many/particles/0001.firn").stat().st_size / 2**20
        self.assertGreater(20 * particles, 0.5 * quick, "frames that pile up would be seen")
        self.assertEqual(self.hashes("many"), self.hashes("quick"))

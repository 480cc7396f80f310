# SPDX-License-Identifier: MIT
"""The built program from end to end, as a person or a script uses it: what it writes, which exit code it ends with, that
an interrupted run goes on as if nothing had happened, and that the same scene gives the same bits however it is run.

usage: test_program.py FIRN [fast | slow | TEST...]"""
import fcntl
import json
import os
import pty
import random
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
import unittest
from pathlib import Path

FIRN = sys.argv[1] if len(sys.argv) > 1 else "build/firn"
PATIENCE = float(os.environ.get("FIRN_TEST_PATIENCE", "1"))  # longer for builds with sanitizers

SCENES = Path(__file__).resolve().parents[2] / "scenes"
SCENE = Path(__file__).with_name("tiny.toml").read_text(encoding="utf-8")
# Some tenths of a second a frame: long enough to be interrupted in one.
LARGER = ["--set", "image.samples=24", "--set", "image.width=320", "--set", "image.height=240"]


class ProgramTest(unittest.TestCase):
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

    def manifest(self, run):
        return json.loads(self.firn("info", run, "--json").stdout)

    def hashes(self, run):
        """Everything that must not change: the bits of snow and light and of the files of every frame."""
        frames = self.manifest(run)["frames"]
        return [(f["frame"], f["particles_hash"], f["picture_hash"], f["files"]) for f in frames]

    def names(self, folder):
        return sorted(path.name for path in (self.here / folder).iterdir())


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


class Interruptions(ProgramTest):
    def interrupt(self, run, frames, kind=signal.SIGINT):
        """Interrupts the starting run once it has `frames` pictures; returns how long it took to end."""
        last = self.here / run / "frames" / f"{frames - 1:04}.png"
        words = [FIRN, "run", self.scene, "--out", run, *LARGER]
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        with subprocess.Popen(words, cwd=self.here, **pipes) as process:
            while not last.exists() and process.poll() is None:
                time.sleep(0.002)
            begin = time.monotonic()
            process.send_signal(kind)
            said = process.communicate(timeout=60)[1]
            self.assertEqual(process.returncode, 130, said)
            self.assertIn(f"firn resume {run}", said)
            return time.monotonic() - begin

    def whole(self):
        self.firn("run", self.scene, "--out", "whole", *LARGER)
        return self.hashes("whole")

    def test_an_interrupted_run_ends_at_once_and_resumes_to_the_same_bits(self):
        whole = self.whole()
        for frames, kind in ((1, signal.SIGINT), (3, signal.SIGTERM)):
            run = f"stopped{frames}"
            self.assertLess(self.interrupt(run, frames, kind), 2 * PATIENCE)
            manifest = self.manifest(run)
            self.assertEqual(manifest["status"], "interrupted")
            kept = self.hashes(run)
            self.assertGreaterEqual(len(kept), frames)
            self.assertLess(len(kept), 6)
            self.assertEqual(kept, whole[:len(kept)])
            before = (self.here / run / "frames/0000.png").stat().st_mtime_ns
            self.firn("resume", run)
            self.assertEqual(self.hashes(run), whole)
            self.assertEqual(self.manifest(run)["status"], "complete")
            self.assertEqual((self.here / run / "frames/0000.png").stat().st_mtime_ns, before)
            rows = (self.here / run / "metrics.csv").read_text()
            self.assertEqual(rows, (self.here / "whole/metrics.csv").read_text())

    def test_a_killed_run_resumes_to_the_same_bits(self):
        whole = self.whole()
        words = [FIRN, "run", self.scene, "--out", "killed", "--quiet", *LARGER]
        with subprocess.Popen(words, cwd=self.here) as process:
            while not (self.here / "killed/frames/0003.png").exists() and process.poll() is None:
                time.sleep(0.002)
            process.kill()
        self.assertEqual(self.manifest("killed")["status"], "running")
        self.firn("resume", "killed")
        self.assertEqual(self.hashes("killed"), whole)

    def test_a_lost_checkpoint_costs_time_but_no_bits(self):
        whole = self.whole()
        self.interrupt("stopped", 2)
        checkpoints = sorted((self.here / "stopped/checkpoints").iterdir())
        self.assertTrue(checkpoints)
        for path in checkpoints:
            path.unlink()
        self.firn("resume", "stopped")
        self.assertEqual(self.hashes("stopped"), whole)

    def test_a_run_stopped_at_any_moment_and_again_in_its_resumes_comes_to_the_same_bits(self):
        whole = self.whole()
        rows = (self.here / "whole/metrics.csv").read_text()
        random.seed(7)
        for round in range(6):
            run = f"often{round}"
            words = ["run", self.scene, "--out", run, *LARGER, "--set", "output.checkpoint_every=1", "--quiet"]
            if round % 2:
                words.append("--no-overlap")
            for kind in [signal.SIGINT, signal.SIGKILL, signal.SIGTERM, signal.SIGKILL, None]:
                with subprocess.Popen([FIRN, *words], cwd=self.here, stdout=subprocess.DEVNULL) as process:
                    while not (self.here / run / "run.json").exists() and process.poll() is None:
                        time.sleep(0.001)
                    if kind is not None:
                        time.sleep(random.uniform(0, 0.4))
                        process.send_signal(kind)
                    process.wait(timeout=60)
                words = ["resume", run, "--quiet"]
            self.assertEqual(process.returncode, 0)
            self.assertEqual(self.hashes(run), whole, run)
            self.assertEqual((self.here / run / "metrics.csv").read_text(), rows)
            self.assertFalse(list((self.here / run).rglob("*.part")))
            self.assertFalse((self.here / run / ".firn-lock").exists())

    # Loaded into firn, this kills it at a chosen write: with its bytes in a temporary file, or just after that got its name.
    KILLER = r"""
    #define _GNU_SOURCE
    #include <signal.h>
    #include <stdio.h>
    #include <stdlib.h>
    #include <string.h>
    #include <sys/syscall.h>
    #include <unistd.h>
    static void reach(const char* moment, const char* path) {
      static int reached;
      if (strcmp(moment, getenv("KILL_WHEN")) || !strstr(path, getenv("KILL_AT"))) return;
      if (__sync_add_and_fetch(&reached, 1) == atoi(getenv("KILL_COUNT"))) kill(getpid(), SIGKILL);
    }
    int fsync(int file) {
      char link[64], path[4096] = "";
      snprintf(link, sizeof link, "/proc/self/fd/%d", file);
      if (readlink(link, path, sizeof path - 1) > 0) reach("before", path);
      const int result = syscall(SYS_fsync, file);
      reach("after", path);
      return result;
    }
    int rename(const char* from, const char* to) {
      const int result = syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
      reach("after", to);
      return result;
    }
    """

    @unittest.skipIf(PATIENCE > 1, "the sanitizers want to be loaded first")
    def test_a_kill_at_the_write_of_any_file_loses_nothing(self):
        self.write("killer.c", self.KILLER.replace("#include <signal.h>", "#include <fcntl.h>\n#include <signal.h>"))
        subprocess.run(["cc", "-shared", "-fPIC", "-o", "killer.so", "killer.c"], cwd=self.here, check=True)
        size = ["--set", "output.particles=true", "--set", "output.checkpoint_every=1"]
        self.firn("run", self.scene, "--out", "whole", *size)
        whole, rows = self.manifest("whole"), (self.here / "whole/metrics.csv").read_text()

        def start(words, when, place, count):
            environment = os.environ | {"LD_PRELOAD": str(self.here / "killer.so"), "KILL_WHEN": when, "KILL_AT": place, "KILL_COUNT": str(count)}
            done = subprocess.run([FIRN, *words, "--quiet"], cwd=self.here, env=environment, stdout=subprocess.DEVNULL, timeout=60)
            self.assertIn(done.returncode, (0, -9))
            return done.returncode == -9

        random.seed(11)
        kills = {}
        for place in ("/run.json", "/frames.jsonl", "/scene.resolved", "/metrics.csv", "/frames/", "/particles/", "/checkpoints/", "/movie", "/trace.json"):
            for when in ("before", "after"):
                run, most = f"run{len(kills)}", 4 if place.endswith("/") or "jsonl" in place else 1
                killed = start(["run", self.scene, "--out", run, *size], when, place, random.randint(1, most))
                if not (self.here / run / "run.json").exists():  # before the run began: nothing to go on from
                    self.firn("run", self.scene, "--out", run, *size)
                again = sum(start(["resume", run], when, place, random.randint(1, min(most, 2))) for _ in range(2))
                kills[place, when] = (killed, again)
                self.firn("resume", run)
                told = self.manifest(run)
                for one, other in zip(whole["frames"], told["frames"], strict=True):
                    for key in ("frame", "particle_steps", "metrics", "particles_hash", "picture_hash", "files"):
                        self.assertEqual(one[key], other[key], run)
                self.assertEqual((told["status"], told["movie_hash"]), ("complete", whole["movie_hash"]), run)
                self.assertEqual((self.here / run / "metrics.csv").read_text(), rows)
                self.assertEqual([path for path in (self.here / run).rglob("*") if ".part" in path.name or "firn-lock" in path.name], [])
                self.assertIn("complete", self.firn("resume", run).stderr)
        for (place, when), (killed, again) in kills.items():
            print(f"{place:18}{when:8}killed in run: {int(killed)}, in resume: {again}")
        self.assertGreaterEqual(sum(killed + again for killed, again in kills.values()), 20)
        self.assertTrue(all(any(sum(kills[place, when]) for when in ("before", "after")) for place, _ in kills))

    def test_a_kill_soon_after_a_resume_does_not_throw_the_simulation_back(self):
        self.interrupt("stopped", 3)
        with subprocess.Popen([FIRN, "resume", "stopped", "--quiet"], cwd=self.here, stdout=subprocess.DEVNULL) as process:
            while self.manifest("stopped")["status"] != "running" and process.poll() is None:
                time.sleep(0.001)
            process.kill()
        self.assertNotIn("from the start", self.firn("resume", "stopped").stderr)
        self.assertEqual(self.hashes("stopped"), self.whole())

    def test_the_last_checkpoints_are_kept_and_a_damaged_one_is_passed_over(self):
        whole = self.whole()
        words = ["run", self.scene, "--out", "run", *LARGER, "--set", "output.checkpoint_every=1", "--quiet"]
        with subprocess.Popen([FIRN, *words], cwd=self.here) as process:
            while not (self.here / "run/frames/0005.png").exists() and process.poll() is None:
                time.sleep(0.001)
            process.kill()
        names = self.names("run/checkpoints")
        self.assertGreater(len(names), 1)
        self.assertLessEqual(len(names), 4)  # three, and one that was about to go
        latest = self.here / "run/checkpoints" / names[-1]
        latest.write_bytes(latest.read_bytes()[:-1] + b"x")
        (self.here / f"run/frames/{int(names[-1][:4]):04}.png").unlink()
        said = self.firn("resume", "run").stderr
        self.assertIn("damaged checkpoint", said)
        self.assertNotIn("from the start", said)
        self.assertEqual([h[:3] for h in self.hashes("run")], [h[:3] for h in whole])

    def test_info_tells_what_a_run_did(self):
        self.firn("run", self.scene, "--out", "a", "--set", "output.particles=true")
        told = json.loads(self.firn("info", "a", "--json").stdout)
        self.assertEqual((told["status"], told["seed"], told["first_frame"], told["last_frame"]), ("complete", 3, 0, 5))
        self.assertEqual([f["frame"] for f in told["frames"]], list(range(6)))
        for frame in told["frames"]:
            self.assertGreaterEqual(frame["simulate_s"], 0)
            self.assertGreater(frame["trace_s"], 0)
            for key in ("particles_hash", "picture_hash"):
                self.assertRegex(frame[key], "^[0-9a-f]{16}$")
        said = self.firn("info", "a").stdout
        for word in ("complete", "6 finished of 0-5", "tiny.toml", "simulate", "trace"):
            self.assertIn(word, said)
        self.firn("simulate", self.scene, "--out", "snow")
        self.assertTrue(all(frame["picture_hash"] == "" for frame in self.manifest("snow")["frames"]))
        self.firn("render", "snow")
        self.assertEqual([h[:3] for h in self.hashes("snow")], [h[:3] for h in self.hashes("a")])
        for words, code in ((["info", "--json"], 2), (["info", "none"], 4), (["info", "a/frames"], 4), (["info", "a", "b"], 2)):
            self.firn(*words, code=code)

    def test_a_complete_run_has_nothing_to_resume(self):
        self.firn("run", self.scene, "--out", "a")
        before = self.hashes("a")
        self.assertIn("complete", self.firn("resume", "a").stderr)
        self.assertEqual(self.hashes("a"), before)


class FirstFrame(ProgramTest):
    def test_a_run_stopped_while_its_first_frame_is_traced_keeps_that_frames_snow(self):
        slow = ["--set", "image.samples=100", "--set", "image.width=160", "--set", "image.height=120", "--set", "output.particles=true",
                "--frames", "0-1"]
        self.firn("run", self.scene, "--out", "whole", *slow)
        for kind, overlap in ((signal.SIGINT, []), (signal.SIGTERM, ["--no-overlap"]), (signal.SIGINT, ["--no-overlap"])):
            run = f"cut{kind}{len(overlap)}"
            with subprocess.Popen([FIRN, "run", self.scene, "--out", run, "--quiet", *slow, *overlap], cwd=self.here,
                                  stdout=subprocess.DEVNULL) as process:
                while not (self.here / run / "run.json").exists() and process.poll() is None:
                    time.sleep(0.001)
                time.sleep(0.1)
                process.send_signal(kind)
            self.assertEqual(process.returncode, 130)
            self.assertEqual(self.manifest(run)["frames"], [])
            self.firn("resume", run)
            self.assertEqual(self.hashes(run), self.hashes("whole"))


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
        for bodies, rest, buried in (([("a", [0, -1, 0], under)], hidden, "collider 'hill'"), ([("a", [0, -1, 0], under)], hidden.replace("false", "true"), "collider 'hill'"),
                                     ([("a", [0, 0.1, 0], "")], hidden, None), ([("a", [0, -5, 0], under)], GROUND, "the ground"), ([("a", [0, -0.2, 0], under)], GROUND, "the ground"),
                                     ([("a", [0, 0.05, 0], under)], GROUND, "the ground"), ([("a", [0, 0.1, 0], "")], GROUND, None),
                                     ([("a", [0, -1, 0], "")], hill, "object[0]"), ([("a", [0, 0.1, 0], "")], hill, None)):
            _, warned = self.check(scene_of(bodies, rest))
            told = re.findall(r"warning: (\S+) % of snow 'a' lies under the surface of (.*)", warned)
            self.assertEqual([solid for _, solid in told], [buried] if buried else [], warned)
            if buried and bodies[0][1][1] < -0.15:
                self.assertEqual(told[0][0], "100")


class Damage(ProgramTest):
    """What a run wrote is changed by others before it is resumed, or looked at again."""

    def damages(self, path):
        whole = path.read_bytes()
        middle = len(whole) // 2
        yield "flipped", whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1:]
        yield "cut", whole[:middle]
        yield "empty", b""
        yield "foreign", (self.here / self.scene).read_bytes()
        yield "missing", None

    def test_resume_makes_every_damaged_file_again(self):
        self.firn("run", self.scene, "--out", "a", "--set", "output.particles=true", "--set", "output.formats=['png','pfm']")
        before = self.hashes("a")
        movie = self.manifest("a")["movie"]
        for name in ("frames/0000.png", "frames/0003.pfm", "frames/0005.png", "particles/0002.firn", movie):
            path = self.here / "a" / name
            whole = path.read_bytes()
            for kind, bytes_now in self.damages(path):
                path.unlink() if bytes_now is None else path.write_bytes(bytes_now)
                self.assertIn(name, self.firn("resume", "a").stderr, kind)
                if not name.endswith(".mp4"):
                    self.assertEqual(path.read_bytes(), whole, f"{name} {kind}")
                self.assertEqual(self.hashes("a"), before)
        self.assertIn("complete", self.firn("resume", "a").stderr)

    def test_only_the_damaged_frames_are_made_again(self):
        random.seed(3)
        for words in (["--set", "output.particles=true"], []):
            self.firn("run", self.scene, "--out", "a", "--overwrite", "--set", "output.checkpoint_every=2", *words)
            records, rows = self.manifest("a")["frames"], (self.here / "a/metrics.csv").read_text()
            movie = self.manifest("a")["movie_hash"]
            for round in range(8):
                damaged, simulated = set(random.sample(range(6), random.randint(1, 4))), set()
                for frame in damaged:
                    kind = random.choice(["frames/{:04}.png", "particles/{:04}.firn"]) if words else "frames/{:04}.png"
                    if not words or kind.startswith("particles"):
                        simulated.add(frame)
                    (self.here / "a" / kind.format(frame)).write_bytes(b"")
                before = {frame: (self.here / f"a/frames/{frame:04}.png").stat().st_mtime_ns for frame in range(6)}
                self.assertRegex(self.firn("resume", "a", *["--no-overlap"] * (round % 2)).stderr, r"frames? [-\d, ]+ (is|are) made again")
                told = self.manifest("a")
                self.assertEqual({f for f in range(6) if (self.here / f"a/frames/{f:04}.png").stat().st_mtime_ns != before[f]}, damaged)
                self.assertLessEqual({old["frame"] for old, new in zip(records, told["frames"]) if old["simulate_s"] != new["simulate_s"]}, simulated)
                for old, new in zip(records, told["frames"]):
                    for key in ("frame", "particle_steps", "metrics", "particles_hash", "picture_hash", "files"):
                        self.assertEqual(old[key], new[key])
                self.assertEqual((told["status"], told["movie_hash"]), ("complete", movie))
                self.assertEqual((self.here / "a/metrics.csv").read_text(), rows)
                records = told["frames"]

    def test_the_making_again_may_be_stopped_at_any_moment(self):
        random.seed(4)
        self.firn("run", self.scene, "--out", "a", *LARGER, "--set", "output.particles=true", "--set", "output.checkpoint_every=1")
        before, rows = self.hashes("a"), (self.here / "a/metrics.csv").read_text()
        for round in range(6):
            for name in ("frames/0001.png", "particles/0002.firn", "frames/0004.png", "particles/0005.firn"):
                (self.here / "a" / name).unlink(missing_ok=True)
            for kind in random.sample([signal.SIGTERM, signal.SIGKILL, signal.SIGINT], 2):
                with subprocess.Popen([FIRN, "resume", "a", "--quiet"], cwd=self.here, stdout=subprocess.DEVNULL) as process:
                    time.sleep(random.uniform(0.01, 0.5))
                    process.send_signal(kind)
            self.firn("resume", "a")
            self.assertEqual(self.hashes("a"), before)
            self.assertEqual((self.here / "a/metrics.csv").read_text(), rows)
            self.assertIn("complete", self.firn("resume", "a").stderr)

    def test_resume_writes_the_rows_of_metrics_anew(self):
        self.firn("run", self.scene, "--out", "a")
        path = self.here / "a/metrics.csv"
        whole = path.read_text()
        for text in (whole[:200], whole.replace(",", ";"), ""):
            path.write_text(text)
            (self.here / "a/frames/0004.png").unlink()
            self.firn("resume", "a")
            self.assertEqual(path.read_text(), whole)

    def test_a_changed_scene_is_not_gone_on_from(self):
        self.firn("run", self.scene, "--out", "a")
        (self.here / "a/frames/0004.png").unlink()
        resolved = self.here / "a/scene.resolved.toml"
        text = resolved.read_text()
        resolved.write_text(text.replace("seed = 3", "seed = 4"))
        self.assertIn("scene.resolved.toml", self.firn("resume", "a", code=2).stderr)
        self.assertIn("seed = 4", resolved.read_text())
        resolved.write_text(text)
        manifest = (self.here / "a/run.json").read_text()
        (self.here / "a/run.json").write_text(manifest.replace("seed = 3", "seed = 4"))
        self.assertIn("damaged manifest", self.firn("resume", "a", code=4).stderr)
        (self.here / "a/run.json").write_text(manifest)
        self.write(self.scene, SCENE.replace("seed = 3", "seed = 4"))  # the user's own file may change: the run keeps its copy
        self.firn("resume", "a")
        self.assertEqual(self.manifest("a")["seed"], 3)

    def test_a_changed_file_of_the_scene_is_not_gone_on_from(self):
        corner = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        self.write("rock.obj", corner)
        self.write("rocky.toml", SCENE + '\n[[collider]]\nname = "rock"\nshape = "mesh"\nfile = "rock.obj"\noffset = [0.3, 0.0, 0.0]\n')
        self.firn("run", "rocky.toml", "--out", "a", "--set", "output.particles=true")
        before = self.hashes("a")
        (self.here / "a/frames/0004.png").unlink()
        for text in (corner.replace("0.1", "0.2"), ""):
            self.write("rock.obj", text)
            for words in (["resume", "a"], ["render", "a"], ["render", "a", "--out", "b"]):
                self.assertIn("rock.obj", self.firn(*words, code=4).stderr)
                self.assertFalse((self.here / "b").exists())
        (self.here / "rock.obj").unlink()
        line = 1 + (self.here / "rocky.toml").read_text().splitlines().index('file = "rock.obj"')
        for words in (["resume", "a"], ["render", "a"], ["render", "a", "--out", "b"]):  # where the user wrote it
            self.assertRegex(self.firn(*words, code=4).stderr, rf"^\S*/rocky.toml:{line}:\d+: no such file: \S+rock.obj\n$")
        self.write("rocky.toml", "[[")
        self.assertRegex(self.firn("resume", "a", code=4).stderr, r"^\S+/rock.obj: no such file")
        (self.here / "rocky.toml").unlink()
        self.assertRegex(self.firn("resume", "a", code=4).stderr, r"^\S+/rock.obj: no such file")
        self.write("rock.obj", corner)
        self.firn("resume", "a")
        self.assertEqual(self.hashes("a"), before)

    def test_render_makes_damaged_pictures_of_a_run_again(self):
        self.firn("simulate", self.scene, "--out", "a")
        self.firn("render", "a")
        path = self.here / "a/frames/0002.png"
        whole = path.read_bytes()
        for kind, bytes_now in self.damages(path):
            path.unlink() if bytes_now is None else path.write_bytes(bytes_now)
            self.firn("render", "a")
            self.assertEqual(path.read_bytes(), whole, kind)

    def test_a_forged_manifest_is_refused_at_once(self):
        self.firn("run", self.scene, "--out", "a")
        whole = (self.here / "a/run.json").read_text()
        for key, value in (("last_frame", 2147483647), ("last_frame", -1), ("first_frame", -5), ("first_frame", 3)):
            forged = json.loads(whole)
            forged[key] = value
            (self.here / "a/run.json").write_text(json.dumps(forged))
            self.assertIn("damaged manifest", self.firn("resume", "a", code=4).stderr)
            self.firn("render", "a", code=4)


    def test_a_complete_run_is_repaired_without_a_frame_missing(self):
        self.firn("run", self.scene, "--out", "a")
        whole = {name: (self.here / "a" / name).read_bytes() for name in ("metrics.csv", "scene.resolved.toml")}
        (self.here / "a/metrics.csv").write_text("garbage")
        (self.here / "a/scene.resolved.toml").unlink()
        (self.here / "a/frames/0001.png.part").write_text("half")
        self.assertIn("complete", self.firn("resume", "a").stderr)
        for name, content in whole.items():
            self.assertEqual((self.here / "a" / name).read_bytes(), content)
        self.assertFalse((self.here / "a/frames/0001.png.part").exists())

    def test_edits_of_a_manifest_are_refused(self):
        self.firn("run", self.scene, "--out", "a")
        path = self.here / "a/run.json"
        whole = path.read_text()
        for old, new in (('"last_frame": 5', '"last_frame": 7'), ('"seed": 3', '"seed": 4'), ('"slots": 3', '"slots": 2000000000')):
            self.assertIn(old, whole)
            path.write_text(whole.replace(old, new))
            for words in (["resume", "a"], ["render", "a"]):
                self.assertIn("damaged manifest", self.firn(*words, code=4).stderr)

    def test_frames_whose_lines_in_the_journal_are_damaged_are_made_again(self):
        self.firn("run", self.scene, "--out", "a")
        self.firn("run", self.scene, "--out", "other", "--seed", "4")
        before, path = self.hashes("a"), self.here / "a/frames.jsonl"
        whole = path.read_text()
        lines = whole.splitlines(keepends=True)
        edited = whole.replace('"frames/0002.png":', '"frames/0009.png":')
        none, all = "complete", "frames 0-5 are made again"
        for kind, text, told in (("edited", edited, "frame 2 is"), ("flipped", whole.replace('"mass_kg":', '"mass_kg":7', 1), "frame 0 is"),
                                 ("cut", whole[:-40], "frame 5 is"), ("lines lost", "".join(lines[:1] + lines[2:3] + lines[5:]), "frames 1, 3-4 are"),
                                 ("empty", "", all), ("missing", None, all), ("garbage", "\0{}\n[1]\n" * 9, all),
                                 ("turned", "".join(reversed(lines)), none), ("twice", whole + whole, none),
                                 ("foreign", (self.here / "other/frames.jsonl").read_text(), all)):
            path.unlink() if text is None else path.write_text(text)
            said = self.firn("resume", "a").stderr
            self.assertIn(told, said, kind)
            self.assertEqual(self.hashes("a"), before, kind)

    def test_a_journal_is_added_to_and_not_written_anew(self):
        self.firn("run", self.scene, "--out", "a")
        header = (self.here / "a/run.json").stat().st_size
        self.firn("run", self.scene, "--out", "b", "--set", "time.frames=60", "--set", "image.width=8", "--set", "image.height=8")
        self.assertAlmostEqual((self.here / "b/run.json").stat().st_size, header, delta=100)
        self.assertEqual(len((self.here / "b/frames.jsonl").read_text().splitlines()), 60)

    def test_a_rendering_is_not_gone_on_from_other_snow(self):
        self.firn("simulate", self.scene, "--out", "snow")
        self.firn("render", "snow", "--out", "pictures")
        before = self.hashes("pictures")
        (self.here / "pictures/frames/0004.png").unlink()
        os.rename(self.here / "snow", self.here / "old")
        self.firn("simulate", self.scene, "--out", "snow", "--seed", "99")
        self.assertIn("other snow", self.firn("resume", "pictures", code=4).stderr)
        self.firn("simulate", self.scene, "--out", "snow", "--overwrite")
        self.firn("resume", "pictures")
        self.assertEqual(self.hashes("pictures"), before)

    def test_kernels_of_other_bits_do_not_go_on(self):
        for isa in ("base", "auto"):
            self.firn("run", self.scene, "--out", isa, "--isa", isa)
            before = self.hashes(isa)
            (self.here / isa / "frames/0003.png").unlink()
            if self.manifest(isa)["isa"] != "base":
                self.assertIn("--isa", self.firn("resume", isa, "--isa", "base", code=2).stderr)
            elif "v3" in self.firn("info").stdout:
                self.assertIn("--isa", self.firn("resume", isa, "--isa", "x86-64-v3", code=2).stderr)
            self.firn("resume", isa)
            self.assertEqual(self.hashes(isa), before)

    def test_counts_of_steps_are_of_a_frame_alone_however_it_was_come_by(self):
        counts = lambda run: [(f["frame"], f["particle_steps"]) for f in self.manifest(run)["frames"]]
        self.firn("run", self.scene, "--out", "a")
        before = counts("a")
        for frame in (4, 1):
            (self.here / f"a/frames/{frame:04}.png").unlink()
            self.firn("resume", "a")
            self.assertEqual(counts("a"), before)
        self.firn("render", self.scene, "--out", "b", "--frames", "3-4")
        self.assertEqual(counts("b"), before[3:5])

    def test_render_does_not_pass_over_an_edited_scene_of_the_run(self):
        self.firn("simulate", self.scene, "--out", "a")
        resolved = self.here / "a/scene.resolved.toml"
        resolved.write_text(resolved.read_text().replace("width = 48", "width = 24"))
        for words in (["render", "a"], ["render", "a", "--out", "b"]):
            self.assertIn("has been changed", self.firn(*words, code=2).stderr)

    def test_strings_of_any_characters_survive_a_resume(self):
        self.write("odd.toml", SCENE.replace('name = "tiny"', 'name = "tiny"\ndescription = "a\\u0000b\\r\\u001b\\u007f\\t\\n\\"\\\\ \\u00e4"'))
        self.firn("run", "odd.toml", "--out", "a", "--frames", "0-2")
        (self.here / "a/frames/0001.png").unlink()
        self.firn("resume", "a")
        self.firn("check", "a/scene.resolved.toml")

    def test_a_folder_whose_name_is_not_utf8_is_refused_where_a_manifest_would_lie(self):
        folder = os.fsencode(self.here) + b"/bad\xff"
        os.mkdir(folder)
        with open(folder + b"/rock.obj", "w", encoding="utf-8") as file:
            file.write("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        with open(folder + b"/rocky.toml", "w", encoding="utf-8") as file:
            file.write(SCENE + '\n[[object]]\nshape = "mesh"\nfile = "rock.obj"\n')
        done = subprocess.run([FIRN, "run", folder + b"/rocky.toml", "--out", "a"], cwd=self.here, capture_output=True, timeout=60)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(b"UTF-8", done.stderr)
        self.assertFalse((self.here / "a").exists())


class Writers(ProgramTest):
    def test_a_run_is_not_rendered_over_itself(self):
        self.firn("simulate", self.scene, "--out", "a")
        os.symlink("a", self.here / "link")
        before = self.names("a/particles")
        for out in ("a", "./a/", "link"):
            self.assertIn("without --out", self.firn("render", "a", "--out", out, "--overwrite", code=2).stderr)
        self.assertEqual(self.names("a/particles"), before)

    def test_an_overwriting_start_that_fails_leaves_the_old_run_whole(self):
        self.firn("run", self.scene, "--out", "a")
        before = {path: path.read_bytes() for path in (self.here / "a").rglob("*") if path.is_file()}
        full = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
        for words in (["run", self.scene], ["run", "a/scene.resolved.toml"]):
            self.firn(*words, "--out", "a", "--overwrite", code=4, limit=full)
            self.assertEqual({path: path.read_bytes() for path in (self.here / "a").rglob("*") if path.is_file()}, before)

    def test_starts_at_the_same_time_take_folders_of_their_own(self):
        running = [subprocess.Popen([FIRN, "run", self.scene, "--quiet"], cwd=self.here, stdout=subprocess.PIPE, text=True) for _ in range(4)]
        said = sorted(process.communicate(timeout=60)[0].strip() for process in running)
        self.assertEqual(said, ["out/tiny", "out/tiny-2", "out/tiny-3", "out/tiny-4"])

    def test_a_signal_before_the_first_frame_ends_firn_at_once_and_leaves_nothing(self):
        fine = ["--set", "simulation.particles_across=200"]
        before = self.names(".")
        for kind in (signal.SIGINT, signal.SIGTERM):
            for words in (["check", self.scene, *fine], ["run", self.scene, *fine, "--out", "new/a"], ["check", "-"]):
                with subprocess.Popen([FIRN, *words], cwd=self.here, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                    time.sleep(0.15)
                    begin = time.monotonic()
                    process.send_signal(kind)
                    self.assertEqual(process.wait(timeout=30), 130, words)
                    self.assertLess(time.monotonic() - begin, 1 * PATIENCE)
                self.assertEqual(self.names("."), before, words)

    def test_an_ignored_interrupt_stays_ignored(self):
        ignore = lambda: signal.signal(signal.SIGINT, signal.SIG_IGN)
        with subprocess.Popen([FIRN, "run", self.scene, "--out", "a", "--quiet"], cwd=self.here, stdout=subprocess.DEVNULL, preexec_fn=ignore) as process:
            while not (self.here / "a/run.json").exists() and process.poll() is None:
                time.sleep(0.001)
            process.send_signal(signal.SIGINT)
        self.assertEqual(process.returncode, 0)

    def test_one_process_at_a_time_writes_into_a_run(self):
        words = [FIRN, "run", self.scene, "--out", "a", "--quiet", "--set", "image.samples=200"]
        with subprocess.Popen(words, cwd=self.here, stdout=subprocess.DEVNULL) as process:
            while not (self.here / "a/run.json").exists() and process.poll() is None:
                time.sleep(0.001)
            for words in (["resume", "a"], ["run", self.scene, "--out", "a", "--overwrite"],
                          ["simulate", self.scene, "--out", "a", "--overwrite"]):
                self.assertRegex(self.firn(*words, code=4).stderr, rf"^a: .*written by process {process.pid} on \S+\n")
            process.send_signal(signal.SIGSTOP)  # alive, if silent
            self.firn("resume", "a", code=4)
            process.send_signal(signal.SIGCONT)
            process.kill()
        self.firn("resume", "a")
        self.assertEqual(self.manifest("a")["status"], "complete")

    def test_a_pipe_in_place_of_a_file_is_refused_at_once(self):
        self.firn("run", self.scene, "--out", "a")
        for name in ("log.txt", "run.json", "frames.jsonl", "frames/0002.png", "metrics.csv", "scene.resolved.toml", "trace.json"):
            shutil.copytree(self.here / "a", self.here / "b")
            (self.here / "b" / name).unlink()
            os.mkfifo(self.here / "b" / name)
            done = subprocess.run([FIRN, "resume", "b"], cwd=self.here, capture_output=True, text=True, timeout=20 * PATIENCE)
            self.assertIn(done.returncode, (0, 4), name)
            if done.returncode == 4:
                self.assertIn(name, done.stderr)
            shutil.rmtree(self.here / "b")

    def test_a_start_that_fails_leaves_nothing(self):
        full = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
        before = self.names(".")
        self.firn("run", self.scene, "--out", "new/a", code=4, limit=full)
        self.assertEqual(self.names("."), before)


class Sharing(ProgramTest):
    """Several processes that render the frames of one run."""
    LEFT_OVER = (".firn-lock", "frames/*.firn-claim", "**/*.part")

    def setUp(self):
        super().setUp()
        self.firn("simulate", self.scene, "--out", "a", *LARGER)
        self.firn("run", self.scene, "--out", "whole", *LARGER)
        self.pictures = [h[2] for h in self.hashes("whole")]

    def start(self, *words):
        return subprocess.Popen([FIRN, "render", "a", *words], cwd=self.here, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def end(self, process, code=0):
        said = process.communicate(timeout=120)[1]
        self.assertEqual(process.returncode, code, said)
        return said

    def wait_for(self, condition, process):
        while not condition() and process.poll() is None:
            time.sleep(0.002)

    def lines(self):
        """The frames whose pictures were recorded, each as often as it was rendered."""
        records = [json.loads(line) for line in (self.here / "a/frames.jsonl").read_text().splitlines()]
        return sorted(record["frame"] for record in records if record["picture_hash"])

    def check_whole(self):
        self.assertEqual([h[2] for h in self.hashes("a")], self.pictures)
        for name in self.LEFT_OVER:
            self.assertEqual(list((self.here / "a").glob(name)), [])
        self.assertEqual(self.manifest("a")["status"], "complete")
        self.assertIn("complete", self.firn("resume", "a").stderr)

    def test_each_frame_is_rendered_once(self):
        for count, words in ((2, []), (4, ["--overwrite"]), (3, ["--overwrite", "--no-overlap", "--threads", "1"])):
            before = self.lines()
            processes = [self.start(*words) for _ in range(count)]
            for process in processes:
                self.end(process)
            if count == 2:
                self.assertEqual(self.lines(), list(range(6)))
            else:  # one that starts later may find frames finished that were to be overwritten
                self.assertLessEqual(len(self.lines()) - len(before), 6 * count)
            self.check_whole()

    def test_frames_of_a_process_that_is_killed_are_rendered_by_the_others(self):
        for kind, code in ((signal.SIGKILL, -9), (signal.SIGTERM, 130), (signal.SIGINT, 130)):
            first = self.start("--overwrite")
            self.wait_for(lambda: list((self.here / "a/frames").glob("*.firn-claim")), first)
            second = self.start("--overwrite")
            time.sleep(0.3)
            first.send_signal(kind)
            self.end(first, code)
            self.end(second)
            self.firn("render", "a")
            self.check_whole()

    def test_a_silent_process_is_waited_for(self):
        first = self.start()
        self.wait_for(lambda: list((self.here / "a/frames").glob("*.firn-claim")), first)
        first.send_signal(signal.SIGSTOP)
        second = self.start("--frames", "0-4")
        self.wait_for(lambda: "waiting for them" in (self.here / "a/log.txt").read_text(), second)
        second.send_signal(signal.SIGINT)
        said = self.end(second, 130)
        self.assertIn("waiting for them", said)
        self.assertIn("firn render a --frames 0-4\n", said)
        self.assertRegex(self.firn("resume", "a", code=4).stderr, r"written by process \d+ on \S+\n")
        first.send_signal(signal.SIGCONT)
        self.end(first)
        self.check_whole()

    def test_writers_and_renderers_keep_one_another_out(self):
        first = self.start()
        self.wait_for(lambda: (self.here / "a/.firn-lock").exists(), first)
        for words in (["resume", "a"], ["simulate", self.scene, "--out", "a", "--overwrite"], ["run", self.scene, "--out", "a", "--overwrite"]):
            self.assertRegex(self.firn(*words, code=4).stderr, rf"^a: .*written by process {first.pid} on \S+\n")
        self.end(first)
        self.check_whole()
        words = [FIRN, "simulate", self.scene, "--out", "b", "--quiet", "--set", "time.frames=4000"]
        with subprocess.Popen(words, cwd=self.here, stdout=subprocess.DEVNULL) as process:
            self.wait_for(lambda: (self.here / "b/particles/0003.firn").exists(), process)
            self.assertIn(f"process {process.pid}", self.firn("render", "b", code=4).stderr)
            self.firn("render", "b", "--out", "c", "--frames", "0-2")
            process.kill()

    def test_a_line_that_was_cut_off_costs_that_line_alone(self):
        self.firn("render", "a", "--frames", "0-2")
        with open(self.here / "a/frames.jsonl", "a", encoding="utf-8") as journal:
            journal.write('{"frame":3,"simul')
        first, second = self.start(), self.start()
        self.end(first)
        self.end(second)
        self.check_whole()

    def test_pictures_of_a_run_of_version_0_1_are_added_to_it(self):
        told = self.manifest("a")
        for frame in told["frames"]:
            frame["film_hash"] = frame.pop("picture_hash")
        told["version"] = "0.1.0"
        (self.here / "a/run.json").write_text(json.dumps({key: value for key, value in told.items() if key != "hash"}))
        (self.here / "a/frames.jsonl").unlink()
        processes = [self.start() for _ in range(3)]
        for process in processes:
            self.end(process)
        self.check_whole()


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
                             (["run", self.scene, "more"], "'more'"), (["xyzzy"], "simulate, render"),
                             (["run", self.scene, "--frames", "4-2"], "2-4"), (["params", "raduis"], "'radius'"),
                             (["run", self.scene, "--set", "image.widht=3"], "'width'")):
            self.assertIn(meant, self.refusal(*words), words)

    def test_what_was_typed_comes_back_in_one_line(self):
        self.write("odd.toml", '"a\\nb" = 1\n')
        for words, code in ((["check", "odd.toml"], 2), (["check", self.scene, "--set", "image.width=3\ny=4"], 2), (["ru\nn"], 2),
                            (["run", self.scene, "--fa\nmes"], 2), (["params", "qw\x1b[31m\n"], 2), (["check", "no\nfile"], 4)):
            self.assertNotRegex(self.refusal(*words, code=code).strip(), r"[\x00-\x1f\x7f]")

    def test_empty_words_are_not_taken_for_none(self):
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


class Movies(ProgramTest):
    def test_a_signal_ends_the_making_of_the_movie_and_resume_makes_it(self):
        (self.here / "ffmpeg").write_text("#!/bin/sh\ntouch begun\nexec sleep 30\n")
        (self.here / "ffmpeg").chmod(0o755)
        around = os.environ | {"PATH": f"{self.here}:{os.environ['PATH']}"}
        for kind in (signal.SIGINT, signal.SIGTERM):
            with subprocess.Popen([FIRN, "run", self.scene, "--out", f"a{kind}"], cwd=self.here, env=around, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE, text=True) as process:
                while not (self.here / "begun").exists() and process.poll() is None:
                    time.sleep(0.001)
                process.send_signal(kind)
                said = process.communicate(timeout=20)[1]
            (self.here / "begun").unlink()
            self.assertEqual(process.returncode, 130, said)
            self.assertIn(f"firn resume a{kind}", said)
            self.assertEqual(self.manifest(f"a{kind}")["status"], "interrupted")
            self.firn("resume", f"a{kind}")
            self.assertTrue(self.manifest(f"a{kind}")["movie"])


class SameBits(ProgramTest):
    def test_threads_instruction_sets_and_overlap_do_not_change_a_bit(self):
        offered = re.search(r"instruction sets\s+(.*?) \(", self.firn("info").stdout).group(1).split(", ")
        reference = None
        for isa in [name for name in offered if name != "base"] or ["base"]:
            for threads in ("1", "2", "4"):
                for overlap in ([], ["--no-overlap"]):
                    run = "-".join([isa, threads, *overlap])
                    self.firn("run", self.scene, "--out", run, "--isa", isa, "--threads", threads, *overlap)
                    self.assertEqual(self.manifest(run)["isa"], isa)
                    reference = reference or self.hashes(run)
                    self.assertEqual(self.hashes(run), reference, run)

    def test_base_repeats_its_own_bits_and_a_seed_changes_them(self):
        self.firn("run", self.scene, "--out", "a", "--isa", "base")
        self.firn("run", self.scene, "--out", "b", "--isa", "base", "--threads", "1")
        self.firn("run", self.scene, "--out", "c", "--isa", "base", "--seed", "4")
        self.assertEqual(self.hashes("a"), self.hashes("b"))
        self.assertNotEqual(self.hashes("a")[0], self.hashes("c")[0])


SLOW = [Estimates, FirstFrame, Interruptions]

if __name__ == "__main__":
    FIRN = str(Path(FIRN).resolve())
    kinds = {word: [kind.__name__ for kind in ProgramTest.__subclasses__() if (kind in SLOW) == (word == "slow")]
             for word in ("fast", "slow")}
    words = [name for word in sys.argv[2:] for name in kinds.get(word, [word])]
    program = unittest.main(argv=[sys.argv[0], *words], exit=False, verbosity=2)
    failed = len(program.result.failures) + len(program.result.errors)
    print(f"{program.result.testsRun - failed} passed, {failed} failed")
    sys.exit(1 if failed or not program.result.testsRun else 0)

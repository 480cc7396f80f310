# SPDX-License-Identifier: MIT
"""Runs that are stopped or killed go on as if nothing had happened."""
import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import time
import unittest

from program import FIRN, LARGER, PATIENCE, ProgramTest


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
        self.start_with("whole", "run", *LARGER)
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
        size = [*LARGER, "--set", "image.samples=10"]
        self.start_with("whole", "run", *size)
        whole, rows = self.hashes("whole"), (self.here / "whole/metrics.csv").read_text()
        random.seed(7)
        for round in range(6):
            run = f"often{round}"
            words = ["run", self.scene, "--out", run, *size, "--set", "output.checkpoint_every=1", "--quiet"]
            if round % 2:
                words.append("--no-overlap")
            for kind in [signal.SIGINT, signal.SIGKILL, signal.SIGTERM, signal.SIGKILL, None]:
                with subprocess.Popen([FIRN, *words], cwd=self.here, stdout=subprocess.DEVNULL) as process:
                    while not (self.here / run / "run.json").exists() and process.poll() is None:
                        time.sleep(0.001)
                    if kind is not None:
                        time.sleep(random.uniform(0, 0.25))
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
    #include <fcntl.h>
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

    def build_killer(self):
        self.write("killer.c", self.KILLER)
        subprocess.run(["cc", "-shared", "-fPIC", "-o", "killer.so", "killer.c"], cwd=self.here, check=True)

    def killed(self, words, when, place, count):
        """Whether firn was killed at the write, or ended before it came to that."""
        environment = os.environ | {"LD_PRELOAD": str(self.here / "killer.so"), "KILL_WHEN": when, "KILL_AT": place, "KILL_COUNT": str(count)}
        done = subprocess.run([FIRN, *words, "--quiet"], cwd=self.here, env=environment, stdout=subprocess.DEVNULL, timeout=60)
        self.assertIn(done.returncode, (0, -9))
        return done.returncode == -9

    @unittest.skipIf(PATIENCE > 1, "the sanitizers want to be loaded first")
    def test_a_kill_at_the_write_of_any_file_loses_nothing(self):
        self.build_killer()
        size = ["--set", "output.particles=true", "--set", "output.checkpoint_every=1"]
        self.firn("run", self.scene, "--out", "whole", *size)
        whole, rows = self.manifest("whole"), (self.here / "whole/metrics.csv").read_text()

        random.seed(11)
        kills = {}
        for place in ("/run.json", "/frames.jsonl", "/scene.resolved", "/metrics.csv", "/frames/", "/particles/", "/checkpoints/", "/movie", "/trace.json"):
            for when in ("before", "after"):
                run, most = f"run{len(kills)}", 4 if place.endswith("/") or "jsonl" in place else 1
                killed = self.killed(["run", self.scene, "--out", run, *size], when, place, random.randint(1, most))
                if not (self.here / run / "run.json").exists():  # before the run began: nothing to go on from
                    self.firn("run", self.scene, "--out", run, *size)
                again = sum(self.killed(["resume", run], when, place, random.randint(1, min(most, 2))) for _ in range(2))
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

    @unittest.skipIf(PATIENCE > 1, "the sanitizers want to be loaded first")
    def test_a_kill_at_any_write_of_a_run_that_replaces_another_leaves_one_of_the_two(self):
        self.build_killer()
        other, mine = ["--set", "output.particles=true", "--set", "output.formats=['png','pfm']", "--seed", "4"], ["--frames", "0-2"]
        self.firn("run", self.scene, "--out", "new", *mine)
        self.start_with("old", "run", *other)
        time.sleep(1.1)  # the time of a start is kept in seconds
        files = lambda run: sorted(str(path.relative_to(self.here / run)) for path in (self.here / run).rglob("*") if path.is_file() and path.parent.name != "checkpoints")
        for in_the_same_second in (True, False):  # begun in the same second, and in another
            for words in (mine, [*mine, "--seed", "4"]):
                for when, place in (("before", "/run.json"), ("after", "/run.json.part"), ("after", "/run.json"), ("before", "/scene.resolved"), ("before", "/frames.jsonl")):
                    shutil.rmtree(self.here / "a", ignore_errors=True)
                    if in_the_same_second:
                        self.firn("run", self.scene, "--out", "a", *other)
                    else:
                        self.start_with("a", "run", *other)
                    self.assertTrue(self.killed(["run", self.scene, "--out", "a", "--overwrite", *words], when, place, 1))
                    replaced = self.manifest("a")["last_frame"] == 2
                    self.firn("resume", "a")
                    if not replaced:
                        self.assertEqual((self.hashes("a"), files("a")), (self.hashes("old"), files("old")))
                    elif words == mine:
                        self.assertEqual((self.hashes("a"), files("a")), (self.hashes("new"), files("new")))
                    self.assertEqual(len(self.manifest("a")["frames"]), 3 if replaced else 6)
                    self.assertEqual(len(list((self.here / "a/frames").iterdir())), 3 if replaced else 12)

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


class Movies(ProgramTest):
    def test_an_ffmpeg_that_is_deaf_or_leaves_others_behind_keeps_nobody_waiting(self):
        around = os.environ | {"PATH": f"{self.here}:{os.environ['PATH']}"}
        for script, sent, code in (("exec 1>&- 2>&-; touch begun; exec sleep 30", signal.SIGINT, 130), ("sleep 30 & touch begun; exit 1", None, 4),
                                   ("yes & touch begun; exit 1", None, 4), ("sleep 30 & touch begun; exec sleep 30", signal.SIGTERM, 130)):
            (self.here / "ffmpeg").write_text(f"#!/bin/bash\n{script}\n")
            (self.here / "ffmpeg").chmod(0o755)
            with subprocess.Popen([FIRN, "run", self.scene, "--out", "a", "--overwrite", "--quiet"], cwd=self.here, env=around, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL, start_new_session=True) as process:
                while not (self.here / "begun").exists() and process.poll() is None:
                    time.sleep(0.001)
                (self.here / "begun").unlink()
                begin = time.monotonic()
                if sent:
                    process.send_signal(sent)
                self.assertEqual(process.wait(timeout=20), code, script)
                self.assertLess(time.monotonic() - begin, 3 * PATIENCE, script)
                with contextlib.suppress(ProcessLookupError):  # those that were left
                    os.killpg(process.pid, signal.SIGKILL)

    def test_what_an_ffmpeg_did_that_made_no_movie_is_told_and_the_pictures_stay(self):
        around = os.environ | {"PATH": f"{self.here}:{os.environ['PATH']}"}
        self.start_with("whole", "run")
        for script, told in (("#!/bin/sh\nexit 0\n", "made no movie"), ('#!/bin/bash\n: > "${@: -1}"\n', "made no movie"),
                             ("#!/bin/sh\necho no such codec >&2\nexit 1\n", "no such codec"), ("#!/no/such/shell\n", "No such file or directory"),
                             ("#!/bin/sh\nkill -SEGV $$\n", "ffmpeg failed")):
            (self.here / "ffmpeg").write_text(script)
            (self.here / "ffmpeg").chmod(0o755)
            done = subprocess.run([FIRN, "run", self.scene, "--out", "a", "--overwrite"], cwd=self.here, env=around, capture_output=True, text=True)
            self.assertEqual(done.returncode, 4, script)
            self.assertIn(told, done.stderr.splitlines()[-1])
            self.assertEqual(list(self.here.glob("a/movie*")), [], script)
        (self.here / "ffmpeg").unlink()
        self.firn("resume", "a")
        self.assertEqual(self.hashes("a"), self.hashes("whole"))

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

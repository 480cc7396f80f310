# SPDX-License-Identifier: MIT
"""Processes that want the same run folder at the same time."""
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import time

from program import FIRN, LARGER, LONG, PATIENCE, ProgramTest, SCENE


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

    def test_files_that_no_run_made_stay_where_a_run_is_replaced(self):
        self.firn("run", self.scene, "--out", "a", "--set", "output.particles=true")
        mine = {"frames/mine/x.txt", "frames/notes.txt", "frames/1.png", "particles/readme", "notes.txt"}
        for name in mine:
            path = self.here / "a" / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(name)
        self.firn("simulate", self.scene, "--out", "a/frames/inner")
        self.firn("run", self.scene, "--out", "a", "--overwrite", "--frames", "0-1")
        for name in mine:
            self.assertEqual((self.here / "a" / name).read_text(), name)
        self.assertIn("complete", self.firn("resume", "a/frames/inner").stderr)
        self.assertEqual([name for name in self.names("a/frames") if name.startswith("0")], ["0000.png", "0001.png"])
        self.assertEqual(self.names("a/particles"), ["readme"])

    def test_a_run_is_not_replaced_by_one_that_reads_its_files(self):
        self.firn("run", self.scene, "--out", "a", "--set", "output.formats=['png','ppm']")
        self.write("textured.toml", SCENE + '\n[[surface]]\nname = "s"\ntexture = "a/frames/0000.ppm"\n'
                   '[[object]]\nshape = "ball"\ncenter = [0.0, 0.3, 0.0]\nradius = 0.05\nsurface = "s"\n')
        before = self.hashes("a")
        said = self.firn("run", "textured.toml", "--out", "a", "--overwrite", code=2).stderr
        self.assertRegex(said, r"^\S+a/frames/0000.ppm: .*--overwrite would remove")
        self.assertEqual(self.hashes("a"), before)
        self.firn("run", "textured.toml", "--out", "b")

    def test_starts_at_the_same_time_take_folders_of_their_own(self):
        running = [subprocess.Popen([FIRN, "run", self.scene, "--quiet"], cwd=self.here, stdout=subprocess.PIPE, text=True) for _ in range(4)]
        said = sorted(process.communicate(timeout=60)[0].strip() for process in running)
        self.assertEqual(said, ["out/tiny", "out/tiny-2", "out/tiny-3", "out/tiny-4"])

    def test_a_signal_before_the_first_frame_ends_firn_at_once_and_leaves_nothing(self):
        fine = ["--set", "simulation.particles_across=200"]
        before = self.names(".")
        for kind in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            heed = lambda: signal.signal(kind, signal.SIG_DFL)  # under nohup it is ignored
            for words in (["check", self.scene, *fine], ["run", self.scene, *fine, "--out", "new/a"], ["check", "-"]):
                with subprocess.Popen([FIRN, *words], cwd=self.here, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                      preexec_fn=heed) as process:
                    time.sleep(0.15)
                    begin = time.monotonic()
                    process.send_signal(kind)
                    self.assertEqual(process.wait(timeout=30), 130, words)
                    self.assertLess(time.monotonic() - begin, 1 * PATIENCE)
                self.assertEqual(self.names("."), before, words)

    def test_an_ignored_interrupt_stays_ignored(self):
        for kind in (signal.SIGINT, signal.SIGHUP):
            ignore = lambda: signal.signal(kind, signal.SIG_IGN)
            with subprocess.Popen([FIRN, "run", self.scene, "--out", f"a{kind}", "--quiet"], cwd=self.here, stdout=subprocess.DEVNULL, preexec_fn=ignore) as process:
                while not (self.here / f"a{kind}/run.json").exists() and process.poll() is None:
                    time.sleep(0.001)
                process.send_signal(kind)
            self.assertEqual(process.returncode, 0)

    def test_one_process_at_a_time_writes_into_a_run(self):
        words = [FIRN, "run", self.scene, "--out", "a", "--quiet", *LONG]
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

    def test_a_run_whose_folder_goes_away_leaves_the_next_one_of_that_name_alone(self):
        self.start_with("whole", "run", *LONG, "--seed", "9")
        whole = self.hashes("whole")
        for round, go_away in enumerate([lambda run: shutil.rmtree(run, ignore_errors=True), lambda run: run.rename(f"{run}-moved")] * 3):
            run = self.here / f"a{round}"
            words = [FIRN, "run", self.scene, "--out", run.name, "--quiet", *LONG]
            with subprocess.Popen(words, cwd=self.here, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as first:
                while not (run / "log.txt").exists() and first.poll() is None:  # it has begun
                    time.sleep(0.001)
                time.sleep(0.05 * round)
                go_away(run)
                shutil.rmtree(run, ignore_errors=True)  # what was written meanwhile
                self.firn(*words[1:], "--seed", "9")
                self.assertRegex(first.communicate(timeout=60)[1], "this folder was moved or removed|cannot write")
            self.assertEqual(first.returncode, 4)
            self.assertEqual(self.hashes(run.name), whole)
            self.assertIn("complete", self.firn("resume", run.name).stderr)

    def test_an_empty_folder_in_the_place_of_a_run_stays_empty(self):
        words = [FIRN, "run", self.scene, "--out", "a", "--quiet", *LONG]
        with subprocess.Popen(words, cwd=self.here, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
            while not (self.here / "a/frames/0001.png").exists() and process.poll() is None:
                time.sleep(0.001)
            time.sleep(0.02)  # between two frames: a write that has begun is not called back
            (self.here / "a").rename(self.here / "b")
            (self.here / "a").mkdir()
            self.assertRegex(process.communicate(timeout=60)[1], "this folder was moved or removed|cannot write")
        self.assertEqual(process.returncode, 4)
        self.assertEqual(self.names("a"), [])
        self.start_with("whole", "run", *LONG)
        self.firn("resume", "b")
        self.assertEqual(self.hashes("b"), self.hashes("whole"))

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
        self.start_with("a", "simulate", *LARGER)
        self.start_with("whole", "run", *LARGER)
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
        held = sorted(path.stem for path in (self.here / "a/frames").glob("*.firn-claim"))
        second = self.start("--frames", f"{int(held[0])}-{int(held[-1])}")
        self.wait_for(lambda: "waiting for them" in (self.here / "a/log.txt").read_text(), second)
        second.send_signal(signal.SIGINT)
        said = self.end(second, 130)
        self.assertIn("waiting for them", said)
        self.assertRegex(said, r"firn render a --frames \d-\d\n")
        self.assertRegex(self.firn("resume", "a", code=4).stderr, r"written by another process on \S+\n")
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

    def test_the_hint_of_an_interrupted_rendering_renders_what_is_left(self):
        for words in (["--overwrite"], ["--overwrite", "--frames", "1-5"]):
            before = self.lines()
            first = self.start("--no-overlap", *words)
            self.wait_for(lambda: len(self.lines()) >= len(before) + 3, first)
            first.send_signal(signal.SIGTERM)
            hint = re.search(r"Continue with: firn (.*)\n", self.end(first, 130))[1]
            made = len(self.lines()) - len(before)
            times = lambda: {path.name: path.stat().st_mtime_ns for path in (self.here / "a/frames").iterdir()}
            then = times()
            self.firn(*hint.split())
            made_now = [name for name, at in times().items() if then.get(name) != at]
            self.assertEqual(made + len(made_now), 5 if "--frames" in words else 6, f"{hint} after {made}")
            self.check_whole()

    def test_one_that_joins_and_fails_leaves_the_others_at_work(self):
        first = self.start("--threads", "1")
        self.wait_for(lambda: list((self.here / "a/frames").glob("*.firn-claim")), first)
        full = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
        self.firn("render", "a", code=4, limit=full)
        self.assertIn(str(first.pid), (self.here / "a/.firn-lock").read_text())
        self.end(first)
        self.check_whole()

    def test_the_refusal_names_one_that_lives(self):
        first = self.start("--threads", "1", "--no-overlap")
        self.wait_for(lambda: (self.here / "a/.firn-lock").exists() and "shared" in (self.here / "a/.firn-lock").read_text(), first)
        second = self.start("--frames", "5", "--quiet")
        self.end(second)
        if first.poll() is None:
            self.assertIn("being written by another process on", self.firn("resume", "a", code=4).stderr)
        self.end(first)
        self.check_whole()

    def test_a_frame_without_a_record_is_told_before_anything_is_rendered(self):
        whole = (self.here / "a/frames.jsonl").read_text()
        for line in (0, 3, 5):
            lines = whole.splitlines(keepends=True)
            lines[line] = lines[line].replace("mass_kg", "mass_kG")
            (self.here / "a/frames.jsonl").write_text("".join(lines))
            for words in ([], ["--out", "b"], ["--frames", f"{line}-5"]):
                said = self.firn("render", "a", *words, code=2).stderr
                self.assertIn(f"no particles of frame {line}; 'firn resume a' makes what is missing\n", said)
                self.assertEqual(self.names("a/frames"), [])
                self.assertFalse((self.here / "b").exists())
            self.firn("resume", "a")
        self.firn("render", "a")
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

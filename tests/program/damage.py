# SPDX-License-Identifier: MIT
"""What a run wrote is changed by others before it is resumed, or looked at again."""
import json
import os
import random
import shutil
import signal
import subprocess
import time
import unittest

from program import FIRN, LARGER, ProgramTest, SCENE


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

    def test_a_resume_that_cannot_begin_leaves_the_run_as_it_was(self):
        self.firn("run", self.scene, "--out", "a", "--set", "output.particles=true")
        before = self.hashes("a")
        disk = self.here / "disk"
        for name in ("frames", "particles", "checkpoints"):  # on a disk that is not there at the moment
            (self.here / "a" / name).rename(disk)
            (self.here / "a" / name).symlink_to(disk)
            times = {path.name: path.stat().st_mtime_ns for path in disk.iterdir()}
            disk.rename(self.here / "away")
            (self.here / "a/frames/0003.png").unlink() if name == "checkpoints" else None
            self.assertIn(name, self.firn("resume", "a", code=4).stderr)
            (self.here / "away").rename(disk)
            self.firn("resume", "a")
            self.assertEqual({path.name: path.stat().st_mtime_ns for path in disk.iterdir()}, times)
            self.assertEqual(self.hashes("a"), before)
            (self.here / "a" / name).unlink()
            disk.rename(self.here / "a" / name)
        (self.here / "a/frames/0003.png").unlink()
        (self.here / "a/log.txt").unlink()
        (self.here / "a/log.txt").mkdir()
        self.assertIn("log.txt", self.firn("resume", "a", code=4).stderr)
        self.assertEqual(self.hashes("a"), before)

    @unittest.skipIf(os.geteuid(), "needs root, to be another user")
    def test_what_may_not_be_read_is_told_and_not_taken_for_lost(self):
        self.here.chmod(0o777)
        firn = shutil.copy(FIRN, self.here)  # another user may not look into the build folder
        self.firn("run", self.scene, "--out", "a", "--set", "output.particles=true")
        before = self.hashes("a")
        for path in (self.here / "a", *(self.here / "a").rglob("*")):
            os.chown(path, 65534, 65534)
        def refusal(*words):
            done = subprocess.run([firn, *words], cwd=self.here, capture_output=True, text=True, user=65534, group=65534, extra_groups=[], timeout=60)
            self.assertEqual(done.returncode, 4, done.stderr)
            return done.stderr
        for name, told in (("frames", "frames/0000.png: .*ermission denied"), ("particles", "particles/0000.firn: .*ermission denied"),
                           ("run.json", "run.json: .*ermission denied"), ("log.txt", "log.txt: .*ermission denied"), (".", "^a: .*ermission denied")):
            path = self.here / "a" / name
            path.chmod(0)
            (self.here / "a/frames/0002.png").unlink(missing_ok=True) if name == "log.txt" else None
            self.assertRegex(refusal("resume", "a"), told)
            if name == "run.json":
                self.assertRegex(refusal("run", self.scene, "--out", "a", "--overwrite"), told)
            path.chmod(0o755)
            self.assertEqual(self.hashes("a"), before)
        self.firn("resume", "a")
        self.assertEqual(self.hashes("a"), before)

    def test_a_file_larger_than_memory_is_one_that_is_not_what_the_run_wrote(self):
        self.firn("run", self.scene, "--out", "a", "--set", "output.particles=true", "--set", "output.formats=['png','pfm']")
        before = self.hashes("a")
        movie = self.manifest("a")["movie"]
        for name in ("frames/0003.png", "frames/0003.pfm", "particles/0003.firn", movie):
            os.truncate(self.here / "a" / name, 1 << 42)
            self.assertIn(name, self.firn("resume", "a").stderr)
            self.assertEqual(self.hashes("a"), before)
        (self.here / "a/frames/0005.png").unlink()
        latest = self.names("a/checkpoints")[-1]
        os.truncate(self.here / "a/checkpoints" / latest, 1 << 42)
        (self.here / "a/particles/0005.firn").unlink()
        self.assertIn(latest, self.firn("resume", "a").stderr)
        self.assertEqual(self.hashes("a"), before)
        for name in ("scene.resolved.toml", "frames.jsonl", "run.json"):
            os.truncate(self.here / "a" / name, 1 << 42)
            self.assertIn(name, self.firn("resume", "a", code=4).stderr)

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

    def test_a_rendering_of_its_first_frame_alone_is_not_gone_on_from_the_snow_of_another_scene(self):
        self.firn("simulate", self.scene, "--out", "snow")
        self.firn("render", "snow", "--out", "pictures")
        told = self.hashes("pictures")
        (self.here / "pictures/frames.jsonl").write_text((self.here / "pictures/frames.jsonl").read_text().splitlines(keepends=True)[0])
        for change in ("ground.friction=0.05", "simulation.gravity=[0,-30,0]"):  # frame 0 is the same
            self.firn("simulate", self.scene, "--out", "snow", "--overwrite", "--set", change)
            self.assertIn("other snow", self.firn("resume", "pictures", code=4).stderr)
        self.firn("simulate", self.scene, "--out", "snow", "--overwrite")
        self.firn("resume", "pictures")
        self.assertEqual(self.hashes("pictures"), told)

    def test_pictures_stay_where_particles_are_made_again(self):
        self.firn("simulate", self.scene, "--out", "a")
        self.firn("render", "a")
        before = self.hashes("a")
        for name in ("particles/0003.firn", "particles/0000.firn"):
            (self.here / "a" / name).unlink()
            self.firn("resume", "a")
            self.assertEqual([(h[0], h[1], h[2], sorted(h[3])) for h in self.hashes("a")], [(h[0], h[1], h[2], sorted(h[3])) for h in before])

    def test_pictures_stay_where_the_making_of_their_particles_is_interrupted(self):
        self.firn("simulate", self.scene, "--out", "a", "--set", "simulation.particles_across=30")
        self.firn("render", "a")
        before = [h[:3] for h in self.hashes("a")]
        for seconds in (0.03, 0.06, 0.1, 0.15):
            (self.here / "a/particles/0004.firn").unlink(missing_ok=True)
            for path in (self.here / "a/checkpoints").iterdir():
                path.unlink()
            with subprocess.Popen([FIRN, "resume", "a", "--quiet"], cwd=self.here, stdout=subprocess.DEVNULL) as process:
                time.sleep(seconds)
                process.terminate()
            self.firn("resume", "a")
            self.assertEqual([h[:3] for h in self.hashes("a")], before)
            self.assertIn("complete", self.firn("resume", "a").stderr)

    def test_pictures_are_added_by_kernels_of_the_same_bits(self):
        for isa in ("base", "auto"):
            self.firn("run", self.scene, "--out", isa, "--isa", isa, "--set", "output.particles=true")
            before = self.hashes(isa)
            (self.here / isa / "frames/0002.png").unlink()
            if self.manifest(isa)["isa"] != "base":
                self.assertIn("--isa", self.firn("render", isa, "--isa", "base", code=2).stderr)
            self.firn("render", isa)
            self.assertEqual(self.hashes(isa), before)

    def test_another_build_that_goes_on_with_a_run_is_told(self):
        self.firn("simulate", self.scene, "--out", "a")
        self.assertNotIn("begun by", self.firn("render", "a").stderr)
        told = self.manifest("a") | {"version": "0.1.0"}
        (self.here / "a/run.json").write_text(json.dumps({key: value for key, value in told.items() if key != "hash"}))
        (self.here / "a/particles/0003.firn").unlink()
        for words in (["resume", "a"], ["render", "a"]):
            self.assertIn("begun by firn 0.1.0", self.firn(*words).stderr)

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


class MadeAgain(ProgramTest):
    """Which frames a resume makes, and that it may be stopped meanwhile."""

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
        self.start_with("a", "run", *LARGER, "--set", "image.samples=10", "--set", "output.particles=true", "--set", "output.checkpoint_every=1")
        before, rows = self.hashes("a"), (self.here / "a/metrics.csv").read_text()
        for round in range(6):
            for name in ("frames/0001.png", "particles/0002.firn", "frames/0004.png", "particles/0005.firn"):
                (self.here / "a" / name).unlink(missing_ok=True)
            for kind in random.sample([signal.SIGTERM, signal.SIGKILL, signal.SIGINT], 2):
                with subprocess.Popen([FIRN, "resume", "a", "--quiet"], cwd=self.here, stdout=subprocess.DEVNULL) as process:
                    time.sleep(random.uniform(0.01, 0.3))
                    process.send_signal(kind)
            self.firn("resume", "a")
            self.assertEqual(self.hashes("a"), before)
            self.assertEqual((self.here / "a/metrics.csv").read_text(), rows)
            self.assertIn("complete", self.firn("resume", "a").stderr)

    def test_pictures_are_made_of_kept_particles_also_after_an_interruption(self):
        self.firn("run", self.scene, "--out", "a", *LARGER, "--set", "output.particles=true", "--set", "output.checkpoint_every=0")
        before = self.hashes("a")
        for kind in (signal.SIGTERM, signal.SIGKILL):
            for frame in range(1, 6):
                (self.here / f"a/frames/{frame:04}.png").unlink()
            with subprocess.Popen([FIRN, "resume", "a", "--quiet", "--no-overlap"], cwd=self.here, stdout=subprocess.DEVNULL) as process:
                while not (self.here / "a/frames/0002.png").exists() and process.poll() is None:
                    time.sleep(0.002)
                process.send_signal(kind)
            self.assertNotIn("from the start", self.firn("resume", "a").stderr)
            self.assertEqual(self.hashes("a"), before)

# SPDX-License-Identifier: MIT
"""bench/compare.py without a build: the order of its runs, its ratios, what it reads of a report, what it refuses and
what it keeps."""
import io
import json
import signal
import subprocess
import sys
import tempfile
import unittest
from contextlib import redirect_stderr
from pathlib import Path
from unittest import mock

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench"))
import compare  # noqa: E402
from comparing import figures, keep, quiet, sides, turns, work  # noqa: E402

THIS = sides.Side("this tree", ROOT, ROOT / "build", "1" * 40, True, "gcc 12.2.0")
OTHER = sides.Side("the other", ROOT / "elsewhere", ROOT / "elsewhere/build", "2" * 40, False, "gcc 12.2.0", "HEAD~3")
REPORT = {
    "particle_steps_per_second": 2.0e7, "naive_particle_steps_per_second": None, "isa": "x86-64-v4", "particles": 1000,
    "stages": {"p2g": 11.5, "sort": 0.0}, "machine": {"cores": 2}, "fma_peak": 1e11,
    "kernels": [{"kernel": "P2G", "ns": 11.0, "bound": "bytes"}, {"kernel": "G2P", "ns": 30.0, "bound": "flops"}],
    "flights": [{"snow": "smooth", "mean_free_paths_a_cell": 0.5, "ns": 47.0}], "hits": [3, 4],
}


def setUpModule():
    # Looking for busy processes takes half a second each time.
    patch = mock.patch.object(quiet, "busy_processes", return_value=[])
    patch.start()
    unittest.addModuleCleanup(patch.stop)


def refused(words):
    """The exit code and what is said of a command line."""
    said = io.StringIO()
    with redirect_stderr(said):
        try:
            code = compare.main(words)
        except SystemExit as end:
            code = end.code
    return code, said.getvalue()


class OrderTest(unittest.TestCase):
    def test_the_side_that_begins_changes_from_pair_to_pair(self):
        self.assertEqual(turns.order(4), [(0, 1), (1, 0), (0, 1), (1, 0)])

    def test_a_steady_drift_favours_neither_side(self):
        moments = [[], []]
        for moment, side in enumerate(side for pair in turns.order(6) for side in pair):
            moments[side].append(moment)
        self.assertEqual(sum(moments[0]), sum(moments[1]))

    def test_each_side_runs_once_to_warm_up_and_once_a_pair(self):
        with tempfile.TemporaryDirectory() as folder, redirect_stderr(io.StringIO()):
            measurement = turns.Measurement(work.work_of(["run", sys.executable, "-c", "", "{tree}"]), [THIS, OTHER], folder)
            with mock.patch.object(measurement, "attempt", wraps=measurement.attempt) as attempt:
                measurement.warm_up()
                measurement.pairs(3)
            self.assertEqual([call.args[0] for call in attempt.call_args_list], [0, 1, 0, 1, 1, 0, 0, 1])
            self.assertEqual([len(runs.figures) for runs in measurement.runs], [3, 3])
            self.assertEqual(list(Path(folder).iterdir()), [])


class FiguresTest(unittest.TestCase):
    def test_nested_reports_become_named_leaves(self):
        leaves = figures.flat(REPORT)
        self.assertEqual(leaves["stages.p2g"], 11.5)
        self.assertEqual(leaves["kernels.G2P.ns"], 30.0)
        self.assertEqual(leaves["flights.smooth 0.5.ns"], 47.0)
        self.assertEqual(leaves["hits.1"], 4)

    def test_which_figures_are_better_lower_and_which_higher(self):
        lower = ["wall_s", "peak_mb", "stages.p2g", "ms.frame_still", "kernels.P2G.ns", "ns_without", "bytes_per_particle",
                 "tracers.firn.build_ms", "trace_s"]
        higher = ["particle_steps_per_second", "frames_per_second_still", "tracers.firn.primary_mrays", "flop_floor_share",
                  "kernels.P2G.gflops", "ratio", "ratio_to_naive", "rays_per_second"]
        neither = ["particles", "dt", "steps", "isa", "tracers.firn.primary.rays", "tracers.firn.primary.mean_t", "hits.0",
                   "fma_peak", "kernels.P2G.floor_ns", "kernels.P2G.bound", "machine.cores"]
        for names, expected in ((lower, "lower"), (higher, "higher"), (neither, None)):
            self.assertEqual({name: figures.better(name) for name in names}, dict.fromkeys(names, expected))

    def test_ratios_above_one_say_that_this_tree_is_better(self):
        self.assertEqual(figures.ratio("wall_s", 2.0, 3.0), 1.5)
        self.assertEqual(figures.ratio("primary_mrays", 3.0, 2.0), 1.5)

    def test_ratios_are_of_pairs(self):
        figure, why = figures.compare("wall_s", [1.0, 2.0, 4.0], [2.0, 4.0, 4.0])
        self.assertIsNone(why)
        self.assertEqual((figure.ratios, figure.median), ([2.0, 2.0, 1.0], 2.0))

    def test_a_difference_is_seen_where_all_pairs_show_it(self):
        def verdict(ratios):
            return figures.Figure("wall_s", "lower", [], [], ratios).verdict
        self.assertEqual(verdict([1.02, 1.1, 1.2, 1.01, 1.3]), "better")
        self.assertEqual(verdict([0.9] * 5), "worse")
        self.assertEqual(verdict([0.98, 1.1, 1.2, 1.1, 1.2]), "no difference seen")
        self.assertEqual(verdict([1.0002, 1.0003, 1.0001, 1.0004, 1.0002]), "no difference seen")
        self.assertEqual(verdict([1.1, 1.2]), "better?")

    def test_figures_that_a_side_lacks_are_named(self):
        this = [{"wall_s": 1.0, "particle_steps_per_second": 2e7, "stages.p2g": 3.0, "stages.sort": 0.0}]
        other = [{"wall_s": 1.0, "particle_steps_per_second": None, "stages.sort": 0.0}]
        found, lacking = figures.compare_all("sim", this, other, False)
        self.assertEqual([figure.name for figure in found], ["wall_s"])
        self.assertEqual(lacking, ["particle_steps_per_second: missing in the other", "stages.p2g: missing in the other"])

    def test_usual_figures_by_command_and_all_of_them(self):
        names = list(figures.flat({**REPORT, "wall_s": 1.0}))
        self.assertEqual(figures.shown("sim", names, False), ["wall_s", "particle_steps_per_second", "stages.p2g", "stages.sort"])
        self.assertIn("kernels.P2G.ns", figures.shown("sim", names, True))
        self.assertIn("kernels.P2G.ns", figures.shown("a new command", names, False))

    def test_other_work_is_seen(self):
        here, there = figures.flat(REPORT), figures.flat({**REPORT, "particles": 2000, "fma_peak": 2e11})
        self.assertEqual(figures.different_conditions(here, there), ["particles is 1000 in this tree, 2000 in the other"])

    def test_the_table_names_the_better_direction(self):
        figure, _ = figures.compare("wall_s", [1.0] * 5, [2.0] * 5)
        self.assertRegex(list(figures.table([figure]))[1], r"wall_s \(lower is better\) +1 +2 +2\.000 \[2\.000 … 2\.000\]  better")


class WorkTest(unittest.TestCase):
    OUT = Path("/out")

    def test_commands_of_firn_bench(self):
        asked = work.work_of(["sim", "--threads", "2"])
        self.assertEqual(asked.words(THIS, self.OUT), [f"{ROOT}/build/bench/firn-bench", "sim", "--threads", "2", "--json", "/out/figures.json"])

    def test_each_side_fills_the_words_of_a_command(self):
        asked = work.work_of(["run", "{firn}", "--at={tree}", "{out}"])
        self.assertEqual(asked.words(OTHER, self.OUT), [f"{ROOT}/elsewhere/build/firn", f"--at={ROOT}/elsewhere", "/out/run"])
        self.assertEqual(asked.programs, ["firn"])

    def test_a_frame_renders_kept_particles_with_the_options_of_rendering(self):
        asked = work.work_of(["frame", str(ROOT / "scenes/two_snowballs.toml"), "--frame", "3", "--quick", "--threads", "2", "--isa=base"])
        asked.kept = {"this tree": Path("/kept")}
        self.assertEqual(asked.options, ["--quick", "--threads", "2", "--isa=base"])
        self.assertEqual(asked.words(THIS, self.OUT)[1:], ["render", "/kept", "--frames", "3", "--threads", "2", "--isa=base", "--quiet", "--out", "/out/run"])

    def test_run_folders_tell_seconds_rates_and_hashes(self):
        frame = {"simulate_s": 0.5, "trace_s": 2.0, "rays": 100, "particle_steps": 50, "film_hash": "ab", "particles_hash": "cd"}
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "run.json").write_text(json.dumps({"isa": "x86-64-v3", "frames": [frame, {**frame, "film_hash": "ef"}]}))
            reading = work.read_run(Path(folder))
            self.assertEqual((reading.leaves["trace_s"], reading.leaves["rays_per_second"], reading.leaves["isa"]), (4.0, 50.0, "x86-64-v3"))
            self.assertNotIn("write_s", reading.leaves)
            Path(folder, "run.json").write_text(json.dumps({"frames": [frame, frame]}))
            self.assertNotEqual(reading.pictures, work.read_run(Path(folder)).pictures)

    def test_a_journal_tells_what_the_manifests_of_older_commits_told(self):
        frame = {"simulate_s": 0.5, "trace_s": 2.0, "rays": 100, "particle_steps": 50, "particles_hash": "cd"}
        with tempfile.TemporaryDirectory() as folder:
            run, journal = Path(folder, "run.json"), Path(folder, "frames.jsonl")
            run.write_text(json.dumps({"frames": [{**frame, "film_hash": "ab"}, {**frame, "film_hash": "ef"}]}))
            older = work.read_run(Path(folder))
            run.write_text("{}")
            lines = [json.dumps({**frame, "frame": k, "picture_hash": h}) + "\n" for k, h in ((1, "ef"), (0, "ab"))]
            journal.write_text("".join(lines))
            newer = work.read_run(Path(folder))
            self.assertEqual((older.leaves, older.pictures), (newer.leaves, newer.pictures))


# A firn that refuses the scenes and the kept particles of other trees, and writes what a run folder has.
PICKY_FIRN = """#!/bin/sh
tree=$(dirname "$(dirname "$0")")
case $2 in "$tree"/*|*"snow of the other") ;; *) echo "$2: unknown key" >&2; exit 2 ;; esac
while [ "$1" != --out ]; do shift; done
mkdir -p "$2"
echo '{"frames": [{"trace_s": 1.5, "film_hash": "ab"}]}' >"$2/run.json"
"""


class OtherWayTest(unittest.TestCase):
    """An older commit that cannot read this tree's scene, or its particles."""

    def measured(self, kind):
        """The measurement of a pair by two firns, of which only the other is picky."""
        with tempfile.TemporaryDirectory() as folder, redirect_stderr(io.StringIO()):
            tree = Path(folder).resolve()
            both = [sides.Side(name, tree / place, tree / place / "build", "1" * 40, False, "gcc")
                    for name, place in (("this tree", "this"), ("the other", "other"))]
            for side, text in zip(both, (PICKY_FIRN.replace("exit 2", ""), PICKY_FIRN)):
                (side.tree / "scenes").mkdir(parents=True)
                (side.tree / "scenes/snow.toml").write_text("")
                side.build.mkdir()
                (side.build / "firn").write_text(text)
                (side.build / "firn").chmod(0o755)
            with mock.patch.object(work, "ROOT", both[0].tree):
                asked = work.work_of([kind, str(both[0].tree / "scenes/snow.toml")])
                measurement = turns.Measurement(asked, both, folder)
                asked.prepare(both, Path(folder))
                measurement.warm_up()
                measurement.pairs(1)
            return measurement

    def test_it_runs_its_own_scene_of_that_name_and_this_is_told(self):
        measurement = self.measured("movie")
        self.assertEqual(measurement.notes, ["the other refuses this tree's scene file and runs its own of that name"])
        self.assertEqual([runs.conditions["trace_s"] for runs in measurement.runs], [1.5, 1.5])

    def test_it_renders_particles_that_it_simulated_itself_and_this_is_told(self):
        note, = self.measured("frame").notes
        self.assertIn("renders those that it simulated itself; the other refuses this tree's scene file", note)


class RefusalTest(unittest.TestCase):
    def test_an_unknown_commit_is_refused_with_a_hint(self):
        if sides.git("rev-parse", "HEAD") is None:
            self.skipTest("not in a git checkout")
        code, said = refused(["no-such-branch", "--", "sim"])
        self.assertEqual(code, 2)
        self.assertIn("no such commit: 'no-such-branch'", said)
        self.assertIn(sides.git("log", "-1", "--format=%h"), said)

    def test_command_lines_that_ask_for_nothing_or_too_much(self):
        for words, part in [([], "name one commit"), (["HEAD", "--noise", "--", "sim"], "instead of it"),
                            (["HEAD"], "say what to compare"), (["HEAD", "--pairs", "0", "--", "sim"], "--pairs"),
                            (["HEAD", "--", "sim", "--json", "x"], "--json"), (["HEAD", "--", "movie"], "scene file"),
                            (["HEAD", "--", "frame", "no.toml"], "no such scene file"), (["HEAD", "--", "run", "true"], "differs")]:
            code, said = refused(words)
            self.assertEqual(code, 2, words)
            self.assertIn(part, said)

    def test_a_side_that_fails_is_named_with_what_it_said(self):
        with tempfile.TemporaryDirectory() as folder:
            broken = work.work_of(["run", sys.executable, "-c", "print('no such option'); raise SystemExit(3)", "{tree}"])
            with self.assertRaises(sides.Refusal) as caught:
                turns.Measurement(broken, [THIS, OTHER], folder).warm_up()
        self.assertIn("this tree (111111111111) ended with 3:\n  no such option", str(caught.exception))
        self.assertEqual(caught.exception.code, 1)

    def test_an_interruption_keeps_nothing(self):
        handler = signal.getsignal(signal.SIGTERM)
        with mock.patch.object(compare, "compared", side_effect=KeyboardInterrupt), mock.patch.object(keep, "add") as add:
            code, said = refused(["HEAD", "--", "sim"])
        signal.signal(signal.SIGTERM, handler)
        self.assertEqual((code, add.called), (130, False))
        self.assertIn("nothing was kept", said)


class BuildTest(unittest.TestCase):
    def test_the_other_build_takes_over_the_options_that_it_knows(self):
        listed = [{"name": "buildtype", "section": "core", "value": "release"}, {"name": "tests", "section": "user", "value": True},
                  {"name": "openexr", "section": "user", "value": "auto"}, {"name": "later", "section": "user", "value": True},
                  {"name": "cpp_args", "section": "compiler", "value": ["-O2"]}, {"name": "prefix", "section": "directory", "value": "/"}]
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "meson-info").mkdir()
            Path(folder, "meson-info", "intro-buildoptions.json").write_text(json.dumps(listed))
            words = sides.option_words(Path(folder), "option('tests', type: 'boolean')\noption('openexr', type: 'feature')")
        self.assertEqual(sorted(words), ["-Dbuildtype=release", "-Dcpp_args=['-O2']", "-Dopenexr=auto", "-Dtests=false"])

    def test_a_failed_build_shows_the_end_of_its_log(self):
        with tempfile.TemporaryDirectory(dir=ROOT, prefix="build-test-") as folder, redirect_stderr(io.StringIO()):
            log = Path(folder, "build.log")
            with self.assertRaises(sides.Refusal) as caught:
                sides.step([sys.executable, "-c", "print('cannot compile'); raise SystemExit(1)"], log, None, "Building it")
        self.assertIn("Building it failed. The log's end:\n  cannot compile\n", str(caught.exception))
        self.assertIn(str(log.relative_to(ROOT)), str(caught.exception))


class QuietTest(unittest.TestCase):
    BEFORE, AFTER = {"busy": 10.0, "stolen": 1.0, "all": 100.0}, {"busy": 14.0, "stolen": 1.2, "all": 104.0}

    def test_what_others_took_is_what_is_left_of_the_busy_time(self):
        others, stolen = quiet.shares(self.BEFORE, self.AFTER, wall=2.0, own=3.0, cores=2)
        self.assertAlmostEqual(others, 0.25)
        self.assertAlmostEqual(stolen, 0.05)

    def test_counts_that_make_no_sense_tell_nothing(self):
        self.assertIsNone(quiet.shares(self.BEFORE, self.BEFORE, 2.0, 3.0, 2))
        self.assertIsNone(quiet.shares(None, self.AFTER, 2.0, 3.0, 2))

    def test_disturbed_measurements_are_doubtful(self):
        calm = {"load": 0.1, "busy": [], "others": 0.01, "stolen": 0.0}
        self.assertEqual(list(quiet.warnings(calm)), [])
        self.assertEqual(len(list(quiet.warnings({**calm, "others": 0.3, "stolen": 0.2}))), 2)
        self.assertIn("cc1plus", "".join(quiet.warnings({**calm, "others": None, "busy": ["cc1plus"]})))


class RecordTest(unittest.TestCase):
    def kept(self):
        figure, _ = figures.compare("wall_s", [1.0, 1.23456789], [2.0, 2.0])
        return keep.entry(THIS, OTHER, f"movie {ROOT}/scenes/two_snowballs.toml", "x86-64-v4", 2, True, {"load": 0.1}, ["a note"], [figure])

    def test_an_entry_has_all_fields_six_digits_and_no_path_of_this_machine(self):
        kept = self.kept()
        self.assertEqual(list(kept), keep.FIELDS)
        self.assertEqual(kept["this"], {"commit": "1" * 12, "dirty": True, "compiler": "gcc 12.2.0"})
        self.assertEqual(kept["other"], {"commit": "2" * 12, "asked": "HEAD~3", "dirty": False, "compiler": "gcc 12.2.0"})
        self.assertEqual(kept["command"], "movie scenes/two_snowballs.toml")
        self.assertEqual(kept["figures"]["wall_s"]["this"], [1.0, 1.23457])
        self.assertEqual(kept["figures"]["wall_s"]["ratio"], {"median": 1.81, "min": 1.62, "max": 2.0})

    def test_entries_are_lines_of_the_machine_s_file(self):
        with tempfile.TemporaryDirectory() as folder:
            kept = self.kept()
            path = [keep.add(kept, Path(folder)) for _ in range(2)][0]
            self.assertEqual(path.name, kept["machine"]["slug"] + ".jsonl")
            self.assertEqual([json.loads(line) for line in path.read_text().splitlines()], [kept, kept])

    def test_machines_are_named_as_firn_bench_names_them(self):
        first = "processor\t: 0\nvendor_id\t: GenuineIntel\ncpu family\t: 6\nmodel\t\t: 207\nmodel name\t: Intel(R) Xeon(R)\n"
        found = keep.machine(first + "\nprocessor\t: 1\nmodel\t\t: 1\n")
        self.assertEqual((found["slug"], found["cpu"]), ("genuineintel-6-207", "Intel(R) Xeon(R) (family 6, model 207)"))

    def test_the_records_of_the_repository_have_these_fields(self):
        for path in (ROOT / sides.RECORDS).glob("*"):
            for line in path.read_text().splitlines():
                kept = json.loads(line)
                self.assertEqual((list(kept), kept["machine"]["slug"] + ".jsonl"), (keep.FIELDS, path.name))


class CommandLineTest(unittest.TestCase):
    def test_help_names_all_kinds_of_work(self):
        said = subprocess.run([sys.executable, str(ROOT / "bench/compare.py"), "--help"], capture_output=True, text=True, check=True).stdout
        for word in ("COMMIT", "frame SCENE", "movie SCENE", "{firn-bench}", "--noise"):
            self.assertIn(word, said)


if __name__ == "__main__":
    result = unittest.main(verbosity=1, exit=False).result
    failed = len(result.failures) + len(result.errors)
    print(f"{result.testsRun - failed - len(result.skipped)} passed, {failed} failed")
    sys.exit(1 if failed else 0)

# SPDX-License-Identifier: MIT
"""Every file of a run, read by programs that know nothing of firn, and compared with one another: the same pixels in all
formats, the same numbers in all tables, the same bytes as the hashes say. Run by tests/readers/run.py, which brings the
packages; ends with one line: N passed, N failed.

usage: test_files.py FIRN [TEST...]"""
import base64
import csv
import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

FIRN = sys.argv[1] if len(sys.argv) > 1 else "build/firn"
FRAMES, FPS, WIDTH, HEIGHT = 6, 24, 48, 32
LAYERS = {"albedo": 3, "normal": 3, "depth": 1, "sparkle": 3, "subsurface": 3, "samples": 1, "variance": 1}
DESCRIPTION = r'''description = "A ball, \"so to speak\", that falls: ä, ❄, \\ and #"'''
SCENE = (Path(__file__).resolve().parents[1] / "program/tiny.toml").read_text(encoding="utf-8")
SCENE = SCENE.replace("[camera]", DESCRIPTION + "\n[camera]", 1).replace("samples = 2", "samples = 4") + f"""
particles = true
tone_map = "srgb"
layers = {json.dumps(["beauty", *LAYERS])}
"""


def module(name):
    """A module of another program, or a skipped test."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise unittest.SkipTest(f"{name}: {error}") from error


def tool(*names):
    """The path of a program of the system, or a skipped test."""
    for name in names:
        if path := shutil.which(name):
            return path
    raise unittest.SkipTest(f"{names[0]} is not installed")


def output_of(*words):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True, timeout=120).stdout


def an_ffmpeg(folder):
    """A folder with a program that is named ffmpeg."""
    if path := shutil.which("ffmpeg"):
        return Path(path).parent
    program = module("imageio_ffmpeg").get_ffmpeg_exe()
    folder.mkdir(exist_ok=True)
    if not (folder / "ffmpeg").exists():
        (folder / "ffmpeg").symlink_to(program)
    return folder


def run_firn(here, out, formats, path):
    words = [FIRN, "run", "tiny.toml", "--out", out, "--quiet", "--set", f"output.formats={json.dumps(formats)}"]
    subprocess.run(words, cwd=here, check=True, timeout=300, env=os.environ | {"PATH": str(path)})
    return here / out


class FilesTest(unittest.TestCase):
    """One run for all tests; a second, with an ffmpeg on its PATH, for those that want movie.mp4."""
    @classmethod
    def setUpClass(cls):
        base = FilesTest
        if hasattr(base, "run_folder"):
            return
        base.folder = tempfile.TemporaryDirectory(prefix="firn-readers-")
        unittest.addModuleCleanup(base.folder.cleanup)
        base.here = Path(base.folder.name)
        (base.here / "tiny.toml").write_text(SCENE, encoding="utf-8")
        offered = re.search(r"^pictures\s+(.*)$", output_of(FIRN, "info"), re.M).group(1).split(", ")
        base.formats = [name for name in ("png", "ppm", "pfm", "exr") if name in offered]
        base.run_folder = run_firn(base.here, "run", base.formats, base.here / "nothing")
        base.manifest = json.loads(output_of(FIRN, "info", str(base.run_folder), "--json"))

    def frame(self, number, extension):
        return self.run_folder / f"frames/{number:04}.{extension}"

    def movie_mp4(self):
        if not hasattr(FilesTest, "second"):
            FilesTest.second = run_firn(self.here, "second", ["png", "pfm"], an_ffmpeg(self.here / "ffmpeg"))
        return self.second / "movie.mp4"

    def pixels(self, number=0, run="run"):
        """The developed picture, as Pillow reads the PNG."""
        np, image = module("numpy"), module("PIL.Image")
        return np.asarray(image.open(self.here / run / f"frames/{number:04}.png"))

    def linear(self, number=0, extension="pfm"):
        """A PFM as its definition has it: a header, then rows from the bottom up."""
        np = module("numpy")
        magic, size, scale, values = self.frame(number, extension).read_bytes().split(b"\n", 3)
        width, height = map(int, size.split())
        self.assertEqual(float(scale), -1)
        channels = {b"PF": 3, b"Pf": 1}[magic]
        return np.frombuffer(values, "<f4").reshape(height, width, channels)[::-1]

    def assert_same(self, a, b, what=""):
        module("numpy").testing.assert_array_equal(a, b, what)

    def assert_near(self, a, b, mean):
        """Of lossy pictures: the mean difference, in levels of 256."""
        np = module("numpy")
        self.assertEqual(a.shape, b.shape)
        self.assertLess(float(np.abs(a.astype(float) - b).mean()), mean)


class Pictures(FilesTest):
    def test_png_is_the_same_to_pillow_and_opencv(self):
        for number in range(FRAMES):
            pixels = self.pixels(number)
            self.assertEqual((pixels.shape, pixels.dtype), ((HEIGHT, WIDTH, 3), "uint8"))
            self.assertGreater(pixels.std(), 5)
            self.assert_same(module("cv2").imread(str(self.frame(number, "png")))[:, :, ::-1], pixels)

    def test_png_is_the_same_to_pypng(self):
        np, png = module("numpy"), module("png")
        width, height, rows, about = png.Reader(bytes=self.frame(2, "png").read_bytes()).asRGB8()
        self.assertEqual((width, height, about["bitdepth"]), (WIDTH, HEIGHT, 8))
        self.assert_same(np.array([list(row) for row in rows]).reshape(HEIGHT, WIDTH, 3), self.pixels(2))

    def test_png_is_sound_to_pngcheck(self):
        self.assertIn("OK", output_of(tool("pngcheck"), self.frame(0, "png")))

    def test_ppm_has_the_pixels_of_png_to_pillow_and_opencv(self):
        np, image, cv2 = module("numpy"), module("PIL.Image"), module("cv2")
        for number in range(FRAMES):
            self.assert_same(np.asarray(image.open(self.frame(number, "ppm"))), self.pixels(number))
            self.assert_same(cv2.imread(str(self.frame(number, "ppm")))[:, :, ::-1], self.pixels(number))

    def test_pfm_is_the_same_to_opencv_and_by_its_definition(self):
        cv2 = module("cv2")
        for extension in ("pfm", "albedo.pfm", "normal.pfm", "depth.pfm"):
            read = cv2.imread(str(self.frame(1, extension)), cv2.IMREAD_UNCHANGED)
            read = read[:, :, ::-1] if read.ndim == 3 else read[:, :, None]
            self.assert_same(read, self.linear(1, extension), extension)

    def test_grey_pfm_is_the_same_to_pillow(self):
        np, image = module("numpy"), module("PIL.Image")
        with image.open(self.frame(0, "depth.pfm")) as picture:
            self.assertEqual(picture.mode, "F")
            self.assert_same(np.asarray(picture)[:, :, None], self.linear(0, "depth.pfm"))

    def test_pfm_developed_by_the_srgb_transfer_is_png(self):
        np = module("numpy")
        for number in range(FRAMES):
            x = np.clip(self.linear(number).astype(float), 0, 1)
            levels = 255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
            self.assertLessEqual(np.abs(levels - self.pixels(number)).max(), 0.51)

    def test_layers_mean_what_they_are_named(self):
        np = module("numpy")
        layer = {name: self.linear(0, f"{name}.pfm") for name in LAYERS}
        for name, channels in LAYERS.items():
            self.assertEqual(layer[name].shape, (HEIGHT, WIDTH, channels), name)
        hit = np.isfinite(layer["depth"][:, :, 0])
        self.assertTrue(0 < hit.sum())
        self.assertTrue((layer["depth"][hit] > 0).all())
        self.assertTrue(((layer["albedo"] >= 0) & (layer["albedo"] <= 1)).all())
        self.assertLess(np.linalg.norm(layer["normal"], axis=2).max(), 1 + 1e-5)
        self.assertTrue((layer["samples"] >= 1).all())
        self.assertTrue((layer["variance"] >= 0).all())

    def test_exr_has_the_values_of_pfm_to_openexr(self):
        if "exr" not in self.formats:
            self.skipTest("this firn was built without OpenEXR")
        np = module("numpy")
        channels = module("OpenEXR").File(str(self.frame(1, "exr")), separate_channels=True).channels()
        letters = {"normal": "XYZ", "depth": "Z", "samples": "Y", "variance": "Y"}
        for name in ("", *LAYERS):
            prefix = name and name + "."
            read = np.stack([channels[prefix + letter].pixels for letter in letters.get(name, "RGB")], axis=2)
            self.assert_same(read, self.linear(1, prefix + "pfm"), name)


class Movies(FilesTest):
    def test_webp_has_all_frames_at_their_times_to_pillow(self):
        np, image = module("numpy"), module("PIL.Image")
        ends = 0
        with image.open(self.run_folder / "movie.webp") as movie:
            self.assertEqual((movie.n_frames, movie.size, movie.info["loop"]), (FRAMES, (WIDTH, HEIGHT), 0))
            for number in range(FRAMES):
                movie.seek(number)
                self.assert_near(np.asarray(movie.convert("RGB")), self.pixels(number), 4)
                ends += movie.info["duration"]
                self.assertEqual(ends, round(1000 * (number + 1) / FPS))

    def test_webp_is_sound_to_webpinfo(self):
        said = output_of(tool("webpinfo"), self.run_folder / "movie.webp")
        self.assertIn("No error detected", said)
        self.assertEqual(len(re.findall(r"Chunk ANMF", said)), FRAMES)

    def test_mp4_has_all_frames_at_their_times_to_av(self):
        av, np = module("av"), module("numpy")
        with av.open(str(self.movie_mp4())) as movie:
            stream = movie.streams.video[0]
            self.assertEqual((stream.codec_context.name, stream.average_rate), ("h264", FPS))
            self.assertEqual(stream.codec_context.pix_fmt, "yuv420p")
            frames = list(movie.decode(stream))
        self.assertEqual(len(frames), FRAMES)
        for number, frame in enumerate(frames):
            self.assertAlmostEqual(frame.time, number / FPS, 6)
            self.assert_near(np.asarray(frame.to_ndarray(format="rgb24")), self.pixels(number, "second"), 8)

    def test_mp4_has_all_frames_to_opencv(self):
        cv2 = module("cv2")
        movie, frames = cv2.VideoCapture(str(self.movie_mp4())), []
        self.assertAlmostEqual(movie.get(cv2.CAP_PROP_FPS), FPS, 6)
        while (step := movie.read())[0]:
            frames.append(step[1])
        self.assertEqual(len(frames), FRAMES)
        self.assert_near(frames[-1][:, :, ::-1], self.pixels(FRAMES - 1, "second"), 8)

    def test_mp4_is_sound_to_ffprobe(self):
        words = ["-v", "error", "-count_frames", "-show_streams", "-of", "json", self.movie_mp4()]
        stream = json.loads(output_of(tool("ffprobe"), *words))["streams"][0]
        self.assertEqual((stream["codec_name"], int(stream["nb_read_frames"])), ("h264", FRAMES))
        self.assertEqual(stream["avg_frame_rate"], f"{FPS}/1")

    def test_png_and_webp_decode_in_chromium(self):
        """A page that decodes both and says in its own text what it got: sizes, and the sum of the first pixels."""
        browser = tool("chromium", "chromium-headless-shell", "chromium-browser", "google-chrome")
        files = {"png": self.frame(0, "png"), "webp": self.run_folder / "movie.webp"}
        links = {kind: f"data:image/{kind};base64," + base64.b64encode(path.read_bytes()).decode()
                 for kind, path in files.items()}
        page = self.here / "page.html"
        page.write_text("""<!doctype html><title>wait</title><pre id=said></pre><script>
          async function read(link) {
            const image = new Image();
            image.src = link;
            await image.decode();
            const canvas = document.createElement("canvas");
            canvas.width = image.naturalWidth;
            canvas.height = image.naturalHeight;
            const paper = canvas.getContext("2d", {colorSpace: "srgb"});
            paper.drawImage(image, 0, 0);
            const rgba = paper.getImageData(0, 0, canvas.width, canvas.height).data;
            return [canvas.width, canvas.height, rgba.reduce((sum, x, i) => sum + (i % 4 < 3 ? x : 0), 0)];
          }
          (async () => {
            const said = {};
            for (const [kind, link] of Object.entries(LINKS)) said[kind] = await read(link);
            document.getElementById("said").textContent = "said " + JSON.stringify(said);
          })();
        </script>""".replace("LINKS", json.dumps(links)), encoding="utf-8")
        text = output_of(browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={self.here / 'browser'}",
                         "--virtual-time-budget=20000", "--dump-dom", page.as_uri())
        said = json.loads(re.search(r"said (\{.*?\})<", text).group(1))
        pixels = self.pixels()
        self.assertEqual(said["png"], [WIDTH, HEIGHT, int(pixels.sum())])
        self.assertEqual(said["webp"][:2], [WIDTH, HEIGHT])
        self.assertLess(abs(said["webp"][2] - int(pixels.sum())) / pixels.size, 4)


class Tables(FilesTest):
    def test_metrics_csv_has_the_numbers_of_run_json(self):
        with (self.run_folder / "metrics.csv").open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file, strict=True))
        self.assertEqual([int(row["frame"]) for row in rows], list(range(FRAMES)))
        for row, frame in zip(rows, self.manifest["frames"]):
            self.assertNotIn(None, row)
            metrics = frame["metrics"]
            for name, value in metrics.items():
                if name == "contact_force_N":
                    for contact in value:
                        read = [float(row[f"force_{axis}_N[{contact['collider']}]"]) for axis in "xyz"]
                        self.assertEqual(read, contact["force"])
                elif isinstance(value, list):
                    root, unit = re.fullmatch(r"(.*?)(_(?:kg_m2?_s|m))", name).groups()
                    if root.startswith("bounds_"):
                        read = [row[f"{root.removeprefix('bounds_')}_{axis}{unit}"] for axis in "xyz"]
                    else:
                        read = [row[f"{root}_{axis}{unit}"] for axis in "xyz"]
                    self.assertEqual([float(x) for x in read], value, name)
                elif isinstance(value, str):
                    self.assertEqual(row[name], value, name)
                else:
                    self.assertEqual(float(row[name]), value, name)

    def test_metrics_csv_is_a_table_to_numpy(self):
        np = module("numpy")
        table = np.loadtxt(self.run_folder / "metrics.csv", dtype=str, delimiter=",", quotechar='"', comments=None,
                           encoding="utf-8")
        self.assertEqual(len(table), FRAMES + 1)
        times = table[1:, list(table[0]).index("time_s")].astype(float)
        np.testing.assert_allclose(times, np.arange(FRAMES) * 0.5 / FPS, rtol=0, atol=1e-12)

    def test_run_json_and_each_line_of_frames_jsonl_are_strict_json(self):
        def refuse(word):
            self.fail(f"{word} is no JSON")

        text = (self.run_folder / "run.json").read_text(encoding="utf-8")
        self.assertEqual(json.loads(text, parse_constant=refuse)["status"], "complete")
        lines = (self.run_folder / "frames.jsonl").read_text(encoding="utf-8").splitlines()
        self.assertEqual([json.loads(line, parse_constant=refuse)["frame"] for line in lines], list(range(FRAMES)))

    def test_run_json_and_frames_jsonl_say_the_same_to_jq(self):
        said = output_of(tool("jq"), "-c", "[.status, .seed]", self.run_folder / "run.json")
        self.assertEqual(json.loads(said), ["complete", 3])
        said = output_of(tool("jq"), "-sc", "[length, .[5].metrics.particles]", self.run_folder / "frames.jsonl")
        self.assertEqual(json.loads(said), [FRAMES, self.manifest["frames"][5]["metrics"]["particles"]])

    def test_the_hashes_of_the_manifest_are_those_of_the_files(self):
        digest = module("xxhash").xxh3_64_hexdigest
        for frame in self.manifest["frames"]:
            self.assertTrue(frame["files"])
            for name, hash_of_file in frame["files"].items():
                self.assertEqual(digest((self.run_folder / name).read_bytes()), hash_of_file, name)
            particles = self.run_folder / f"particles/{frame['frame']:04}.firn"
            self.assertEqual(digest(particles.read_bytes()), frame["particles_hash"])

    def test_trace_json_has_the_events_of_the_trace_format(self):
        events = json.loads((self.run_folder / "trace.json").read_text(encoding="utf-8"))["traceEvents"]
        whole = [event for event in events if event["ph"] == "X"]
        self.assertEqual(len(whole), 3 * FRAMES)
        for event in whole:
            self.assertIsInstance(event["name"], str)
            self.assertTrue({"pid", "tid"} <= event.keys())
            self.assertGreaterEqual(min(event["ts"], event["dur"]), 0)
        for event in events:
            self.assertIn(event["ph"], "XM")

    def test_the_resolved_scene_is_toml_to_python_and_tomlkit(self):
        text = (self.run_folder / "scene.resolved.toml").read_text(encoding="utf-8")
        self.assertEqual(self.manifest["scene"], text)
        resolved, given = tomllib.loads(text), tomllib.loads(SCENE)
        self.assertEqual(module("tomlkit").parse(text).unwrap(), resolved)
        self.assertEqual(resolved["description"], given["description"])
        self.assertEqual(resolved["image"]["width"], WIDTH)
        self.assertEqual(resolved["snow"][0]["velocity"], given["snow"][0]["velocity"])
        self.assertEqual(resolved["output"]["formats"], self.formats)

    def test_log_txt_is_utf8_lines(self):
        lines = (self.run_folder / "log.txt").read_text(encoding="utf-8").splitlines()
        self.assertTrue(any("firn" in line for line in lines))


class Particles(FilesTest):
    def read(self, frame):
        """By the table in src/io/particle_file.h: (header, columns by name)."""
        np = module("numpy")
        data = (self.run_folder / f"particles/{frame:04}.firn").read_bytes()
        fields = [("magic", "S8"), ("version", "<u4"), ("frame", "<i4"), ("time", "<f8"), ("origin", "<f8", 3), ("dx", "<f8"),
                  ("n", "<u8"), ("hash", "<u8")]
        header = np.frombuffer(data, fields, 1)[0]
        columns, at = {}, 72
        for name, kind in [*[(name, "<f4") for name in ("x", "y", "z", "vx", "vy", "vz", "density", "volume0")],
                           *[(name, "<i2") for name in ("turn0", "turn1", "turn2")], ("id", "<u4"), ("object", "<u2")]:
            columns[name] = np.frombuffer(data, kind, int(header["n"]), at)
            at += columns[name].nbytes
        self.assertEqual(at, len(data))
        return header, columns

    def test_particle_files_hold_what_their_table_says(self):
        np = module("numpy")
        for number in range(FRAMES):
            header, columns = self.read(number)
            metrics = self.manifest["frames"][number]["metrics"]
            self.assertEqual((header["magic"], header["version"], header["frame"]), (b"FIRNSNAP", 2, number))
            self.assertEqual((header["time"], header["n"]), (metrics["time_s"], metrics["particles"]))
            self.assertEqual(len(set(columns["id"])), header["n"])
            self.assertFalse(columns["object"].any())
            self.assertTrue((columns["density"] > 0).all() and (columns["volume0"] > 0).all())
            place = header["origin"] + np.stack([columns[axis] for axis in "xyz"], axis=1)
            near = {"rtol": 0, "atol": 1e-6}
            np.testing.assert_allclose(place.min(axis=0), metrics["bounds_min_m"], **near)
            np.testing.assert_allclose(place.max(axis=0), metrics["bounds_max_m"], **near)
            speed = np.sqrt(sum(columns[name].astype(float) ** 2 for name in ("vx", "vy", "vz")))
            self.assertAlmostEqual(speed.max(), metrics["max_speed_m_s"], 5)

    def test_a_particle_keeps_its_volume_over_the_run(self):
        np = module("numpy")
        volumes = []
        for number in (0, FRAMES - 1):
            columns = self.read(number)[1]
            volumes.append(columns["volume0"][np.argsort(columns["id"])])
        self.assert_same(*volumes)


if __name__ == "__main__":
    program = unittest.main(argv=[sys.argv[0], *sys.argv[2:]], exit=False, verbosity=2)
    result = program.result
    failed, skipped = len(result.failures) + len(result.errors), len(result.skipped)
    if skipped:
        print(f"{skipped} skipped: " + "; ".join(sorted({why for _, why in result.skipped})))
    passed = result.testsRun - failed - skipped
    print(f"{passed} passed, {failed} failed", flush=True)
    sys.exit(1 if failed or passed <= 0 else 0)

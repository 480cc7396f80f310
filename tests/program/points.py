# SPDX-License-Identifier: MIT
"""Snow made of the points of a file: rendered, simulated, and as good as the snow that the points were taken from."""
import csv
import io
import re
import struct
import zipfile

from program import ProgramTest, SCENE

BALL = re.search(r'shape = "ball"\n.*\n.*\nvelocity = .*\n', SCENE)[0]


def numbers(descr, shape, values):
    """An array as numpy.save writes it."""
    head = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    kind = {"<f8": "<d", "<f4": "<f"}[descr]
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + struct.pack(
        f"<{len(values)}{kind[1]}", *values)


def archive(**arrays):
    """Arrays as numpy.savez_compressed writes them."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as out:
        for name, content in arrays.items():
            with out.open(f"{name}.npy", "w", force_zip64=True) as member:
                member.write(content)
    return packed.getvalue()


def particles_of(path):
    """Places, velocities and volumes of a particle file of firn (src/io/particle_file.h)."""
    raw = path.read_bytes()
    origin, count = struct.unpack_from("<3d", raw, 24), struct.unpack_from("<Q", raw, 56)[0]
    columns = [struct.unpack_from(f"<{count}f", raw, 72 + 4 * count * k) for k in range(8)]
    places = [origin[axis] + x for row in zip(*columns[:3]) for axis, x in enumerate(row)]
    return count, places, [v for row in zip(*columns[3:6]) for v in row], columns[7]


def text_ply(places):
    rows = zip(places[::3], places[1::3], places[2::3])
    return ("ply\nformat ascii 1.0\n" + f"element vertex {len(places) // 3}\n"
            + "".join(f"property double {axis}\n" for axis in "xyz") + "end_header\n"
            + "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in rows))


class Points(ProgramTest):
    def points_scene(self, name, file, keys=""):
        return self.write(name, SCENE.replace(BALL, f'shape = "particles"\nfile = "{file}"\n{keys}'))

    def rows(self, run):
        with (self.here / run / "metrics.csv").open() as lines:
            return [{key: float(value) for key, value in row.items() if re.fullmatch(r"[-+.\de]+", value or "")}
                    for row in csv.DictReader(lines)]

    def require_alike(self, run, other, within):
        for row, like in zip(self.rows(run), self.rows(other), strict=True):
            self.assertEqual(row["particles"], like["particles"])
            for key in ("mass_kg", "kinetic_energy_J", "potential_energy_J", "volume_m3"):
                self.assertAlmostEqual(row[key], like[key], delta=within * max(abs(like[key]), 1e-3), msg=key)

    def test_the_particles_of_a_run_fall_as_those_of_the_run_did(self):
        self.firn("simulate", self.scene, "--out", "ball")
        start = self.here / "ball/particles/0000.firn"
        dx = struct.unpack_from("<d", start.read_bytes(), 48)[0]
        count, places, velocities, volumes = particles_of(start)
        (self.here / "a.npz").write_bytes(archive(
            position=numbers("<f8", (count, 3), places), velocity=numbers("<f4", (count, 3), velocities),
            volume=numbers("<f4", (count,), volumes)))
        grid = ["--set", f"simulation.dx={dx!r}"]
        self.firn("simulate", self.points_scene("a.toml", "a.npz"), "--out", "a", *grid)
        self.require_alike("a", "ball", 1e-4)
        # The particle file itself is one of points, too, and the velocity may be the scene's.
        self.firn("simulate", self.points_scene("b.toml", start), "--out", "b", *grid)
        self.require_alike("b", "ball", 1e-4)
        (self.here / "c.ply").write_text(text_ply(places))
        self.firn("simulate", self.points_scene("c.toml", "c.ply", "velocity = [0.0, -2.0, 0.0]\n"), "--out", "c", *grid)
        self.require_alike("c", "ball", 0.1)  # but for the volume, which is found from their distance

    def test_points_are_rendered_simulated_and_resumed_and_their_file_is_watched(self):
        places = [0.02 * x + 0.1 * (axis == 1) for k in range(125) for axis, x in enumerate((k % 5, k // 5 % 5, k // 25))]
        (self.here / "a.npy").write_bytes(numbers("<f8", (125, 3), places))
        scene = self.points_scene("a.toml", "a.npy", "rotation = [0, 30, 0]\n")
        self.assertIn("125, 0.397", self.firn("check", scene).stdout)
        self.firn("run", scene, "--out", "a")
        self.firn("render", scene, "--out", "still")
        self.assertEqual(self.hashes("still"), self.hashes("a")[:1])
        self.assertIn("a.npy", str(self.manifest("a")))
        self.firn("run", "a/scene.resolved.toml", "--out", "again")
        self.assertEqual(self.hashes("again"), self.hashes("a"))
        (self.here / "a/frames/0003.png").unlink()
        self.firn("resume", "a")
        self.assertEqual(self.hashes("again"), self.hashes("a"))
        (self.here / "a.npy").write_bytes(numbers("<f8", (125, 3), [0.9 * x for x in places]))
        (self.here / "a/frames/0003.png").unlink()
        self.assertIn("a.npy", self.firn("resume", "a", code=4).stderr)

    def test_check_warns_of_points_that_the_grid_or_their_volume_does_not_fit(self):
        places = [0.02 * x for k in range(1000) for x in (k % 10, k // 10 % 10, k // 100)]
        (self.here / "a.npy").write_bytes(numbers("<f8", (1000, 3), places))
        fine = self.firn("check", self.points_scene("a.toml", "a.npy"), "--set", "simulation.dx=0.01").stderr
        self.assertIn("points a cell of the grid and will fall apart: dx = 0.0399 m", fine)
        odd = self.firn("check", self.points_scene("b.toml", "a.npy", "spacing = 0.002\n")).stderr
        self.assertIn("is the file's volume, mass or radius in another unit?", odd)

    def test_broken_points_are_refused_at_the_place_of_the_file(self):
        (self.here / "a.npz").write_bytes(b"PK" + bytes(100))
        said = self.firn("run", self.points_scene("a.toml", "a.npz"), code=4).stderr
        self.assertRegex(said, r"^a\.toml:\d+:\d+: .*a\.npz: damaged ZIP archive")

    def test_archives_of_numpy_itself_are_read(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("numpy is not installed")
        grid = 0.02 * numpy.mgrid[0:5, 0:5, 0:5].reshape(3, -1).T + [0, 0.05, 0]
        numpy.savez(self.here / "a.npz", position=grid, volume=8e-6)
        numpy.savez_compressed(self.here / "b.npz", points=numpy.asfortranarray(grid), volume=numpy.full(125, 8e-6))
        numpy.save(self.here / "c.npy", grid.astype(">f8"))
        for file in ("a.npz", "b.npz", "c.npy"):
            scene = self.points_scene("scene.toml", file, "spacing = 0.02\n")
            self.firn("simulate", scene, "--out", file[0])
        self.assertEqual(self.rows("a"), self.rows("b"))
        self.assertEqual(self.rows("a"), self.rows("c"))

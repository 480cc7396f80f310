#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Builds the fuzzers of this folder with clang, libFuzzer and the address and undefined behaviour sanitizers, and runs
each for some minutes of one core, two side by side. A fuzzer passes when it found nothing. What it found is kept in
build-fuzz/findings/, what it said in build-fuzz/logs/, and the inputs that reached new code in build-fuzz/corpus/, from
where the next run goes on. A finding that is mended goes into tests/fuzz/regressions/READER/, which every test run
replays.

usage: python3 tests/fuzz/run.py [--minutes M] [READER...]      M minutes of one core each, 5 if not said; all readers if none named"""
import argparse
import io
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zipfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build-fuzz"
SEEDS = FOLDER / "seeds"
SIDE_BY_SIDE = 2
# A build with sanitizers and with clang's counters of coverage. Its kernels are those of `base`, for no reader chooses by
# instruction set, and have neither: each would take minutes to compile.
OPTIONS = ["-Dfuzz=true", "-Dtests=false", "-Dbench=false", "-Db_sanitize=address,undefined", "-Db_lundef=false",
           "-Db_pch=false", "-Dunity=off", "-Disas=", "-Doptimization=1", "-Ddebug=true", "-Db_ndebug=false",
           "-Dsanitize_kernels=false", "-Dcpp_args=-g1 -fsanitize=fuzzer-no-link"]
# The sanitizers hold freed memory back, so the process may hold more than any input asks for at once.
LIMITS = ["-timeout=10", "-malloc_limit_mb=1024", "-rss_limit_mb=2560"]
ENVIRONMENT = {"ASAN_OPTIONS": "allocator_may_return_null=0",
               "UBSAN_OPTIONS": f"print_stacktrace=1:halt_on_error=1:suppressions={ROOT}/tests/ubsan.supp"}


@dataclass
class Fuzzer:
    name: str
    longest: int  # bytes of an input
    scenes: tuple = ()  # seeds among the files of scenes/
    words: tuple = ()  # of the format


FUZZERS = [
    Fuzzer("scene", 16384, ("*.toml",),
           ("[[", "]]", "\0quick\n", "\0image.width=320\n", "snow[0].radius=0.1\n", "inf", "nan", "1979-05-27T07:32:00Z",
            '"""', "'''", "\\u0000", "0x", "-0.0", "1e308")),
    Fuzzer("mesh", 4096, ("boot_tread.obj",),
           ("v ", "vn ", "vt ", "f ", "g ", "o ", "s ", "l ", "p ", "t ", "vw ", "usemtl ", "mtllib ", "1/1/1", "1//1", "-1",
            "1e308", "nan")),
    Fuzzer("heights", 4096, (),
           ("P2", "P5", "ncols ", "nrows ", "cellsize ", "nodata_value ", "xllcorner ", "-9999", "1e308")),
    Fuzzer("images", 4096, (), ("IHDR", "IDAT", "PLTE", "tRNS", "IEND", "gAMA", "iCCP", "P6", "PF", "Pf", "-1.0")),
    Fuzzer("particles", 1024),
    Fuzzer("points", 4096, (),
           ("ply\n", "format ascii 1.0\n", "format binary_little_endian 1.0\n", "element vertex ", "element face ",
            "property float x\n", "property double y\n", "property list uchar int vertex_indices\n", "end_header\n",
            "comment ", "obj_info ", "velocity_x", "scalar_vx", "pscale", "\x01NUMPY", "'descr': '<f8'", "'>i4'", "'|O'",
            "'fortran_order': True", "'shape': (2, 3)", "PK\x01\x02", "PK\x03\x04", "PK\x05\x06", "PK\x06\x06",
            "PK\x06\x07", "position.npy", "velocity.npy", "F.npy", "Jp.npy", "nan", "1e999")),
    Fuzzer("checkpoint", 8192),
    Fuzzer("state", 16384),
    Fuzzer("manifest", 16384),
    Fuzzer("journal", 16384),
]


def array(shape, values, descr="<f8"):
    """An array as numpy.save writes it."""
    head = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + struct.pack(
        descr[0] + str(len(values)) + {"f8": "d", "f4": "f", "i4": "i"}[descr[1:]], *values)


def archive(method, **arrays):
    """Arrays as numpy.savez writes them, or numpy.savez_compressed."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as out:
        for name, content in arrays.items():
            with out.open(f"{name}.npy", "w", force_zip64=True) as member:
                member.write(content)
    return packed.getvalue()


PLACES = (0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1)  # of 4 points
PLY_HEAD = ("element vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty list uchar short tags\n"
            "property double radius\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n")
TEXT_SEEDS = {
    "scene/overrides": (ROOT / "scenes/two_snowballs.toml").read_bytes() + b"\0quick\nsnow.young_modulus=2e5\nimage.width=64\n"
                       b"snow[0].radius=0.1\n",
    "mesh/tetrahedron.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
    "mesh/quads.obj": b"mtllib a.mtl\no box\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nusemtl b\n"
                      b"f 4/1/1 3/2/1 2/3/1 1\nf -4 -3 -2 -1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n",
    "points/all.npz": archive(zipfile.ZIP_STORED, position=array((4, 3), PLACES), velocity=array((4, 3), PLACES, ">f4"),
                              volume=array((), (1e-3,)), Jp=array((4,), (1, 1, 0.9, 1)),
                              F=array((4, 3, 3), 4 * (1, 0, 0, 0, 1, 0, 0, 0, 1), "<i4")),
    "points/packed.npz": archive(zipfile.ZIP_DEFLATED, points=array((4, 3), PLACES), mass=array((4, 1), (1, 2, 3, 4))),
    "points/places.npy": array((4, 3), PLACES),
    "points/text.ply": ("ply\r\nformat ascii 1.0\r\ncomment a\r\nobj_info b\r\n" + PLY_HEAD.replace("\n", "\r\n")
                        + "0 0 0 2 7 8 0.1\r\n1 0 0 0 0.1\r\n3 0 1 0\r\n").encode(),
    "points/little.ply": ("ply\nformat binary_little_endian 1.0\n" + PLY_HEAD).encode()
                         + 2 * (struct.pack("<fffB", 1, 2, 3, 1) + struct.pack("<hd", 7, 0.1)) + struct.pack("<Biii", 3, 0, 1, 0),
    "points/big.ply": ("ply\nformat binary_big_endian 1.0\n" + PLY_HEAD).encode()
                      + 2 * (struct.pack(">fffB", 1, 2, 3, 0) + struct.pack(">d", 0.1)) + struct.pack(">Biii", 3, 0, 1, 0),
    "heights/text.pgm": b"P2\n# a comment\n3 2\n255\n0 51 102\n153 204 255\n",
    "heights/small.pgm": b"P5 3 2 255\n\x00\x33\x66\x99\xcc\xff",
    "heights/wide.pgm": b"P5 2 2 65535\n\x00\x00\x33\x66\x99\xcc\xff\xff",
    "heights/grid.asc": b"ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 0.5\nNODATA_value -9999\n1 2 3\n4 5.5 6e0\n",
}


def clang_fuzzes():
    """Whether clang++ and its runtime can build a fuzzer here."""
    if not shutil.which("clang++"):
        return False
    text = 'extern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long) { return 0; }'
    with tempfile.TemporaryDirectory() as folder:
        words = ["clang++", "-fsanitize=fuzzer,address,undefined", "-x", "c++", "-", "-o", f"{folder}/fuzzer"]
        return subprocess.run(words, input=text, text=True, capture_output=True).returncode == 0


def build(names):
    if not (FOLDER / "build.ninja").exists():
        subprocess.run(["meson", "setup", FOLDER, *OPTIONS], cwd=ROOT, env=os.environ | {"CXX": "clang++"}, check=True)
    targets = [f"tests/fuzz/fuzz_{name}" for name in ("seeds", *names)]
    subprocess.run(["ninja", "-C", FOLDER, *targets], check=True)


def escaped(word):
    return '"' + "".join(chr(b) if 32 <= b < 127 and b not in b'"\\' else f"\\x{b:02x}" for b in word.encode()) + '"\n'


def words_of_scenes():
    """Tables, keys and the words in quotes, from what `firn params` prints."""
    text = (SEEDS / "params.txt").read_text()
    paths = re.findall(r"^(?:(\w+)\.)?(\w+)$", text, re.M)
    tables = {table for table, _ in paths if table}
    return sorted({f"{key} = " for _, key in paths} | {f"[{table}]\n" for table in tables}
                  | {f"[[{table}]]\n" for table in tables} | set(re.findall(r'"\w+"', text))
                  | {f'"{word}"' for line in re.findall(r"one of (.*?);", text) for word in line.split(", ")})


def write_seeds(fuzzers):
    shutil.rmtree(SEEDS, ignore_errors=True)
    SEEDS.mkdir()
    subprocess.run([FOLDER / "tests/fuzz/fuzz_seeds", SEEDS], check=True, env=os.environ | ENVIRONMENT)
    for name, content in TEXT_SEEDS.items():
        path = SEEDS / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    for fuzzer in fuzzers:
        for pattern in fuzzer.scenes:
            for path in (ROOT / "scenes").glob(pattern):
                shutil.copy(path, SEEDS / fuzzer.name)
        words = [*fuzzer.words, *(words_of_scenes() if fuzzer.name == "scene" else [])]
        (SEEDS / f"{fuzzer.name}.dict").write_text("".join(map(escaped, words)))
        for made in ("corpus", "findings"):
            (FOLDER / made / fuzzer.name).mkdir(parents=True, exist_ok=True)


def run_for(words, seconds, log):
    """(exit code, CPU seconds) of a fuzzer, begun again until it has had so many: beside other work it gets fewer a second."""
    used = 0.0
    while True:
        with log.open("ab") as out:
            process = subprocess.Popen([*words, f"-max_total_time={math.ceil(seconds - used)}"], stdin=subprocess.DEVNULL, stdout=out,
                                       stderr=subprocess.STDOUT, cwd=FOLDER, env=os.environ | ENVIRONMENT)
            _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        used += usage.ru_utime + usage.ru_stime
        if process.returncode != 0 or used >= seconds:
            return process.returncode, used


def fuzz(fuzzer, minutes):
    """Runs one fuzzer; (whether it found nothing, a line about it, what it found)."""
    dictionary = SEEDS / f"{fuzzer.name}.dict"
    folders = [FOLDER / "corpus" / fuzzer.name, SEEDS / fuzzer.name, ROOT / "tests/fuzz/regressions" / fuzzer.name]
    words = [FOLDER / "tests/fuzz" / f"fuzz_{fuzzer.name}", f"-max_len={fuzzer.longest}",
             f"-artifact_prefix={FOLDER}/findings/{fuzzer.name}/", "-print_final_stats=1", *LIMITS,
             *([f"-dict={dictionary}"] if dictionary.stat().st_size else []),
             *[folder for folder in folders if folder.is_dir()]]
    log = FOLDER / "logs" / f"{fuzzer.name}.log"
    log.parent.mkdir(exist_ok=True)
    log.unlink(missing_ok=True)
    code, used = run_for(words, 60 * minutes, log)
    text = log.read_text(errors="replace")
    runs = sum(int(n) for n in re.findall(r"^stat::number_of_executed_units: (\d+)", text, re.M))
    coverage = re.findall(r"cov: (\d+)", text)
    line = (f"{fuzzer.name:11} {runs:>9} inputs, {coverage[-1] if coverage else 0:>5} edges, {used:.0f} s of one core: "
            f"{'nothing found' if code == 0 else 'FOUND, see ' + str(log.relative_to(ROOT))}")
    found = re.findall(r"^(?:SUMMARY: .*|broken law: .*|==\d+== ?ERROR: .*|.*runtime error: .*|.*Test unit written to .*)$",
                       text, re.M)
    return code == 0, line, [] if code == 0 else list(dict.fromkeys(found)) or text.splitlines()[-10:]


def main():
    names = [fuzzer.name for fuzzer in FUZZERS]
    parser = argparse.ArgumentParser(usage=__doc__.partition("usage: ")[2])
    parser.add_argument("--minutes", type=float, default=5)
    parser.add_argument("reader", nargs="*")
    asked = parser.parse_args()
    if unknown := set(asked.reader) - set(names):
        parser.error(f"no reader '{unknown.pop()}'; there are: {', '.join(names)}")
    if not clang_fuzzes():
        print("skipped: clang++ with its runtime (libclang-rt-*-dev) is needed, and one of them is not here")
        print("0 passed, 0 failed")
        return 0
    fuzzers = [fuzzer for fuzzer in FUZZERS if not asked.reader or fuzzer.name in asked.reader]
    build([fuzzer.name for fuzzer in fuzzers])
    write_seeds(fuzzers)
    passed = 0
    with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
        for good, line, found in pool.map(lambda fuzzer: fuzz(fuzzer, asked.minutes), fuzzers):
            print(line, *found, sep="\n  ", flush=True)
            passed += good
    print(f"{passed} passed, {len(fuzzers) - passed} failed")
    return 0 if passed == len(fuzzers) else 1


if __name__ == "__main__":
    sys.exit(main())

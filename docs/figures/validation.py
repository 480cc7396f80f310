# SPDX-License-Identifier: MIT
"""The figures of docs/validation.md: expected against measured, from the curves that the physics tests write when FIRN_FIGURES
names a folder (`./dev figures` runs them). Dashes are the law, colours are measured. Makes docs/figures/validation/*.svg.

usage: validation.py [FOLDER_OF_CURVES]"""
import sys
from math import log2, log10
from os.path import relpath
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "svg"))
from curves import read  # noqa: E402
from plot import Plot  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "docs/figures/validation"


def against_law(plot, table, x, y, expected, draw=Plot.points):
    for ink, (name, of) in enumerate(table.items()):
        plot.law(of[x], of[expected], None if ink else "expected")
        draw(plot, of[x], of[y], ink, name.replace("mu", "\N{GREEK SMALL LETTER MU}"))
    return plot


def bar(table):
    of = table["bar"]
    plot = Plot("Bar of 1 m between rollers, let go in its lowest mode", "time (s)", "mean velocity / start")
    plot.law(of["time_s"], of["expected"], "cos(2\N{GREEK SMALL LETTER PI} t c_p / 4L)")
    plot.points(of["time_s"][::8], of["velocity"][::8], 0, "measured")
    return plot


def free_fall(table):
    return against_law(Plot("Ball in free fall", "time (s)", "fallen (m)"), table, "time_s", "fallen_m", "expected_m")


def self_weight(table):
    plot = Plot("Column of 1 m under its own weight", "height as placed (m)", "displacement (mm)")
    for ink, (name, of) in enumerate(table.items()):
        plot.law(of["height_m"], [1e3 * u for u in of["expected_m"]], None if ink else "expected", ink)
        plot.points(of["height_m"][ink::3], [1e3 * u for u in of["displacement_m"][ink::3]], ink, name)
    return plot


def incline(table):
    return against_law(Plot("Block on a slope of 20\N{DEGREE SIGN}, tan = 0.364", "time (s)", "speed gained (m/s)"), table, "time_s",
                       "speed_m_s", "expected_m_s")


def frictions(tables):
    plot = Plot("Two coefficients on 20\N{DEGREE SIGN} (0.6 at rest, 0.2 sliding); a domain turned by 35\N{DEGREE SIGN} (0.2)", "time (s)",
                "speed gained (m/s)")
    return against_law(plot, {**tables["two_frictions"], **tables["turned_domain"]}, "time_s", "speed_m_s", "expected_m_s")


def front(table):
    return against_law(Plot("Slab on 36.9\N{DEGREE SIGN} without friction: way of its front", "time (s)", "way (m)"), table, "time_s", "way_m",
                       "expected_m")


def finer(tables):
    plot = Plot("Finer grids: error over what the test allows", "log\N{SUBSCRIPT TWO} of the cells across", "log\N{SUBSCRIPT ONE}\N{SUBSCRIPT ZERO} of error / allowed")
    plot.law([1, 7], [0, 0], "allowed")
    for name in ("finer_bar", "finer_column", "finer_rotation", "finer_incline"):
        for series, of in tables[name].items():
            cells = [log2(n) for n in of["cells"]]
            parts = [log10(max(e, 1e-9) / a) for e, a in zip(of["error"], of["allowed"])]
            ink = len(plot.legend) - 1
            plot.line(cells, parts, ink)
            plot.points(cells, parts, ink, series.replace(" degrees", "\N{DEGREE SIGN}").replace("height, ", ""))
    return plot


def closed(tables):
    plot = Plot("Snow that yields in a closed system: total energy", "time (ms)", "energy / start", (0, 120), (0, 1.05))
    plot.law([0, 120], [1.005, 1.005], "bound of the test")
    for ink, (name, of) in enumerate({**tables["closed_collision"], **tables["closed_fall"]}.items()):
        plot.line([1e3 * t for t in of["time_s"]], of["energy"], ink, name)
    return plot


def twice_dt(table):
    plot = Plot("Elastic ball thrown at the ground: the automatic dt, and twice it", "time (ms)", "energy / start", (0, 80), (0.9, 1.06))
    plot.law([0, 80], [1.005, 1.005], "makes energy")
    for ink, (name, of) in enumerate(table.items()):
        plot.line([1e3 * t for t in of["time_s"]], of["energy"], ink, name)
    return plot


def five_seconds(table):
    plot = Plot("A ball dropped, five seconds at the automatic dt: total energy", "time (s)", "energy / start", (0, 5), (0, 1.05))
    plot.law([0, 5], [1.005, 1.005], "bound of the test")
    for ink, (name, of) in enumerate(table.items()):
        plot.line(of["time_s"], of["energy"], ink, name)
    return plot


def met_balls(table):
    plot = Plot("Two balls of 400 kg/m\N{SUPERSCRIPT THREE} that met: density by distance from the contact", "distance (m)",
                "density (kg/m\N{SUPERSCRIPT THREE})")
    plot.law([0, 0.11], [400, 400], "as placed")
    for ink, (name, of) in enumerate(table.items()):
        plot.line(of["distance_m"], of["density"], ink, name)
    return plot


def bridge(table):
    plot = Plot("Plate over a gap, from presets alone; pressed from 0.3 s on", "time (s)", "its middle has sunk (m)")
    for ink, (name, of) in enumerate(table.items()):
        plot.line(of["time_s"], of["sag_m"], ink, name)
    return plot


def yield_depth(table):
    of = table["snow"]
    plot = Plot("Deep snow: where its own weight first makes it yield", "depth as placed (m)", "compression (%)")
    percent = {name: [100 * value for value in values] for name, values in of.items()}
    plot.law(of["depth_m"], percent["expected"], "elastic, expected")
    plot.points(of["depth_m"], percent["compression"], 0, "elastic")
    plot.line(of["depth_m"], percent["packing"], 1, "plastic, 1 \N{MINUS SIGN} Jp")
    return plot


def cone(table):
    plot = Plot("Cones of grains of 25\N{DEGREE SIGN} and 32\N{DEGREE SIGN}, as placed and at rest", "distance from the axis (m)",
                "height (m)", (0, 0.2), (0, 0.13))
    for ink, (name, of) in enumerate(table.items()):
        plot.law(of["radius_m"], of["start_m"], None if ink else "as placed", ink)
        angle, start = name.split(" from ")
        start, *finer = start.split(" ", 1)
        plot.line(of["radius_m"], of["height_m"], ink, f"{angle}\N{DEGREE SIGN}: {start} \N{RIGHTWARDS ARROW} "
                  f"{of['found_degrees'][0]:.1f}\N{DEGREE SIGN}{' (finer)' if finer else ''}")
    return plot


def columns(tables):
    plot = Plot("Columns of grains: how far they run out", "aspect ratio a = height / length", "run-out / length or radius", (0, 5.4), (0, 8))
    aspects = [0.05 * k for k in range(1, 108)]

    def add(label, law, table, ink):
        expected = [law(a) for a in aspects]
        plot.band(aspects, [0.8 * e for e in expected], [1.2 * e for e in expected], "\N{PLUS-MINUS SIGN} 20 %", ink)
        plot.law(aspects, expected, "laboratory", ink)
        for finer, (name, of) in enumerate(table.items()):
            plot.points(of["aspect"], of["run_out"], ink + 2 * finer, f"{label}, finer" if finer else label)

    add("channel, 33\N{DEGREE SIGN}", lambda a: 1.2 * a if a < 2.3 else 1.9 * a ** (2 / 3), tables["channel_column"], 0)
    add("round, 30\N{DEGREE SIGN}", lambda a: 1.24 * a if a < 1.7 else 1.6 * a ** 0.5, tables["round_column"], 1)
    return plot


def collision(table):
    of = table["snow"]
    plot = Plot("Two balls of snow collide: where the energy goes", "time (ms)", "energy (J)")
    time = [1e3 * t for t in of["time_s"]]
    names = {"kinetic_J": "kinetic", "elastic_J": "elastic", "plastic_J": "plastic work", "lost_J": "lost in transfers"}
    total = [sum(of[name][k] for name in names) for k in range(len(time))]
    plot.law(time, total, "sum of all")
    for ink, (name, label) in enumerate(names.items()):
        plot.line(time, of[name], ink, label)
    if half := table.get("snow, half the cell"):
        plot.points([1e3 * t for t in half["time_s"]], half["lost_J"], len(names), "lost, half the cell")
    return plot


def momentum(table):
    minus_eight = "10\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT EIGHT}"
    plot = Plot("Two balls collide: change of momentum over mass \N{MULTIPLICATION SIGN} 5 m/s, allowed 1000", "time (ms)",
                f"change ({minus_eight})")
    for ink, (name, of) in enumerate(table.items()):
        plot.line([1e3 * t for t in of["time_s"]], [1e8 * p for p in of["momentum"]], ink, name)
    return plot


def packing(table):
    of = table["fresh"]
    plot = Plot("A plate packs fresh snow by a fifth", "time (s)", "energy (J)")
    plot.law(of["time_s"], of["work_J"], "work of the plate")
    plot.points(of["time_s"], [e + p for e, p in zip(of["elastic_J"], of["plastic_J"])], 0, "elastic + plastic")
    plot.line(of["time_s"], of["plastic_J"], 1, "plastic work")
    plot.line(of["time_s"], of["elastic_J"], 2, "elastic energy")
    return plot


def presets(table):
    plot = Plot("Balls thrown at the ground with 6 m/s: total energy", "time (ms)", "energy / start", (0, 80), (0, 1.05))
    plot.law([0, 80], [1.005, 1.005], "bound of the test")
    for ink, (name, of) in enumerate(table.items()):
        plot.line([1e3 * t for t in of["time_s"]], of["energy"], ink, name)
    return plot


def weight(table):
    plot = Plot("A block dropped by a cell and a half: what the ground bears", "time (s)", "force / weight")
    of = table["may sleep"]
    plot.law([0, of["time_s"][-1]], [1, 1], "its weight")
    plot.line(of["time_s"], of["force_of_weight"], 0, "mean of 20 ms")
    asleep = [k for k, part in enumerate(of["asleep"]) if part == 1]
    plot.points([of["time_s"][k] for k in asleep], [of["force_of_weight"][k] for k in asleep], 1, "asleep")
    return plot


def slope_weight(table):
    plot = Plot("A block at rest on 20\N{DEGREE SIGN}: what the ground bears", "time (s)", "force / weight")
    return against_law(plot, table, "time_s", "force_of_weight", "expected")


def impact(table):
    plot = Plot("A ball hits the ground: impulse of the ground, and what the ball gained", "time (s)", "momentum / mass (m/s)")
    return against_law(plot, table, "time_s", "impulse", "expected")


def second_law(table):
    plot = Plot("Ground, wall and bat: acceleration by their forces, and of the momentum", "time (s)", "force / mass (m/s\N{SUPERSCRIPT TWO})")
    return against_law(plot, table, "time_s", "from_forces", "expected")


def thin(tables):
    plot = Plot("Thin colliders: the snow nearest their middle plane, or past it", "time (s)", "on the right side by (cells)")
    plot.law([0, 0.1], [0, 0], "through")
    for ink, (name, of) in enumerate({**tables["thin_plates"], **tables["thin_blade"]}.items()):
        plot.line(of["time_s"], of["cells_above"], ink, name)
    return plot


def saw(tables):
    plot = Plot("Propagation saw test: slopes below and above the layer's friction, 27\N{DEGREE SIGN}",
                "time since the crack passed 1 m (s)", "front (m)", (0, 0.9), (0, 20))
    series = {**tables["saw_flat"], **tables["saw_steep"]}
    shear = next(iter(series.values()))["shear_m_s"][0]
    for part in (0.6, 1.6):
        ends = min(0.9, 19 / (part * shear))
        plot.law([0, ends], [1, 1 + part * shear * ends], f"{part} c_s")
    for ink, (degrees, of) in enumerate(series.items()):
        start = next(t for t, x in zip(of["time_s"], of["front_m"]) if x >= 1)
        shown = [(t - start, x) for t, x in zip(of["time_s"], of["front_m"]) if x >= 1]
        plot.line([t for t, _ in shown], [x for _, x in shown], ink, f"{degrees}\N{DEGREE SIGN}")
    return plot


def free_body(table):
    of = table["body"]
    plot = Plot("Free body, stirred and spinning: change of what it keeps, allowed 10 and 100", "steps",
                "change (10\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT SIX})")
    plot.line(of["step"], [1e6 * value for value in of["momentum"]], 0, "momentum")
    plot.line(of["step"], [1e6 * value for value in of["angular_momentum"]], 1, "angular momentum")
    return plot


def rotation(table):
    of = table["ball"]
    plot = Plot("Rigidly rotating ball: kinetic energy over a turn", "turns", "energy / start", (0, 1), (0.985, 1.015))
    plot.band([0, 1], [0.99, 0.99], [1.01, 1.01], "\N{PLUS-MINUS SIGN} 1 %", 0)
    plot.line(of["turns"], of["energy"], 0, "measured")
    return plot


def drag(table):
    return against_law(Plot("Flakes that fall from rest", "time (v_t / g)", "speed (v_t)"), table, "time", "speed", "expected")


def rolling(tables):
    plot = Plot("A ball rolls down a slope: what it gathers", "way (m)", "gathered / own mass", (0, 1.8), (0, 0.5))
    plot.law([1.4, 1.8], [0.25, 0.25], "sticky, at the end: at least")
    plot.law([1.7, 1.8], [0.05, 0.05], "others: at most", 1)
    for ink, (name, of) in enumerate({**tables["rolling_sticky"], **tables["rolling_loose"]}.items()):
        plot.line(of["way_m"], of["grown"], ink, name)
    return plot


def slab(tables):
    plot = Plot("A slab on a weak layer on 38\N{DEGREE SIGN}: way down the slope", "time (s)", "way (m)")
    for ink, (name, of) in enumerate({**tables["slab_uncut"], **tables["slab_struck"]}.items()):
        plot.line(of["time_s"], of["way_m"], ink, name)
    return plot


# How each figure is drawn: from the curve of its name, or from the named ones.
OF_ONE_CURVE = {
    "bar": bar, "front": front, "twice_dt": twice_dt, "five_seconds": five_seconds, "met_balls": met_balls, "bridge": bridge,
    "free_fall": free_fall, "self_weight": self_weight, "incline": incline, "cone": cone, "yield_depth": yield_depth,
    "collision": collision, "packing": packing, "presets": presets, "weight": weight, "slope_weight": slope_weight,
    "impact": impact, "second_law": second_law, "free_body": free_body, "rotation": rotation, "drag": drag,
}
OF_SEVERAL = {
    "frictions": (frictions, ["two_frictions", "turned_domain"]),
    "finer": (finer, ["finer_bar", "finer_column", "finer_rotation", "finer_incline"]),
    "closed": (closed, ["closed_collision", "closed_fall"]),
    "momentum": (lambda curves: momentum(curves["collision"]), ["collision"]),
    "columns": (columns, ["channel_column", "round_column"]),
    "saw": (saw, ["saw_flat", "saw_steep"]),
    "thin": (thin, ["thin_plates", "thin_blade"]),
    "rolling": (rolling, ["rolling_sticky", "rolling_loose"]),
    "slab": (slab, ["slab_uncut", "slab_struck"]),
}


def main(folder, out=OUT):
    """Draws the figures that there are curves of: tests may be run one by one. Returns the names of the others."""
    curves = {path.stem: read(path) for path in sorted(Path(folder).glob("*.csv"))}
    out.mkdir(exist_ok=True)
    left = []
    for name, draw in OF_ONE_CURVE.items():
        if curves.get(name):
            draw(curves[name]).save(out / f"{name}.svg")
        else:
            left.append(name)
    for name, (draw, needed) in OF_SEVERAL.items():
        if all(curves.get(curve) for curve in needed):
            draw(curves).save(out / f"{name}.svg")
        else:
            left.append(name)
    print(f"{relpath(out, ROOT)}: {len(list(out.glob('*.svg')))} figures")
    return left


if __name__ == "__main__":
    source = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/figures")
    if not list(source.glob("*.csv")):
        sys.exit(f"no curves in {source}: run ./dev figures")
    main(source)

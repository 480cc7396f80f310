# SPDX-License-Identifier: MIT
"""The figures of docs/rendering.md: expected against measured, from the curves that the light tests write when FIRN_FIGURES
names a folder (`./dev figures` runs them), and what bench/integrators.py --curve measured. Dashes are the law, colours are measured, with bars of one standard error. Makes
docs/figures/light/*.svg and prints how far the measurements lie from expectation.

usage: light.py [FOLDER_OF_CURVES]"""
import sys
from math import exp, log2, log10, pi, sqrt
from os.path import relpath
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "svg"))
from curves import read  # noqa: E402
from plot import Plot  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "docs/figures/light"


def bars(plot, xs, ys, errors, ink, label=None):
    plot.points(xs, ys, ink, label)
    for x, y, error in zip(xs, ys, errors):
        plot.line([x, x], [y - error, y + error], ink)


def against_law(plot, table, x, at=lambda value: value, scale=lambda value: value):
    for ink, (name, of) in enumerate(table.items()):
        xs = [at(value) for value in of[x]]
        plot.law(xs, [scale(value) for value in of["expected"]], None if ink else "expected")
        bars(plot, xs, [scale(value) for value in of["measured"]], [scale(error) for error in of["error"]], ink, name)
    return plot


def scores(table, least=1e-7):
    """Distances from expectation in standard errors, of those that have one: more than `least`."""
    rows = [row for of in table.values() for row in zip(of["measured"], of["expected"], of["error"])]
    return [(measured - expected) / error for measured, expected, error in rows if error > least]


def summary(name, z):
    rms, most, far = sqrt(sum(x * x for x in z) / len(z)), max(abs(x) for x in z), sum(abs(x) > 3 for x in z)
    print(f"{name}: {len(z)} scores, rms {rms:.2f}, largest {most:.2f}, {far} beyond 3")


def histogram(title, z):
    width = 0.5
    counts = {}
    for x in z:
        counts[round(x / width)] = counts.get(round(x / width), 0) + 1
    plot = Plot(title, "(measured \N{MINUS SIGN} expected) / standard error", "scores", (-5, 5))
    for at, count in sorted(counts.items()):
        plot.box((at - 0.45) * width, (at + 0.45) * width, 0, count, 0, None if plot.legend else "measured")
    xs = [0.1 * k for k in range(-50, 51)]
    plot.law(xs, [len(z) * width * exp(-x * x / 2) / sqrt(2 * pi) for x in xs], "normal")
    return plot


def slabs(table, name, title):
    """Of g = 0.75, by optical thickness."""
    plot = Plot(title, "log\N{SUBSCRIPT TWO} of the optical thickness", "part of the light", None, (0, 1))
    of = table[name]
    for ink, albedo in enumerate(sorted(set(of["a"]))):
        rows = [row for row in zip(of["a"], of["g"], of["tau"], of["expected"], of["measured"], of["error"])
                if row[0] == albedo and row[1] == 0.75 and row[2] < 1e6]
        xs = [log2(row[2]) for row in rows]
        plot.law(xs, [row[3] for row in rows], None if ink else "expected")
        bars(plot, xs, [row[4] for row in rows], [row[5] for row in rows], ink, f"albedo {albedo:g}")
    return plot


def half_space(table):
    return against_law(Plot("Half space lit from \N{GREEK SMALL LETTER MU}\N{SUBSCRIPT ZERO} = 0.7: radiance", "cosine of the direction",
                            "\N{GREEK SMALL LETTER PI} \N{MULTIPLICATION SIGN} radiance / irradiance across the beam"), table, "mu",
                       scale=lambda value: pi * value)


def snow_albedo(table, model, title):
    plot = Plot(title, "wavelength (nm)", "reflectance, lit from above")
    chosen = {name: of for name, of in table.items() if name.startswith(model) and name.endswith("R_mu0_1")}
    labels = {f"{model} {source} {size} R_mu0_1": f"{source}, {size} \N{MICRO SIGN}m" for source in ("P16", "WB08")
              for size in (100, 500, 1000)}
    return against_law(plot, {labels[name]: of for name, of in chosen.items()}, "nm")


def bed(table):
    labels = {f"{channel} P16 {mu}": f"{colour}, lit {whence}"
              for mu, whence in (("1", "from above"), ("0.5", "at 60\N{DEGREE SIGN}"))
              for channel, colour in (("R", "red"), ("G", "green"), ("B", "blue"))}
    return against_law(Plot("A bed of particles in `reference`, Picard", "grain (\N{MICRO SIGN}m)", "reflectance"),
                       {labels[name]: of for name, of in table.items() if name in labels}, "grain_um")


def way(table):
    plot = Plot("Mean way through a ball of radius 1 that scatters", "log\N{SUBSCRIPT TWO} of the radius in mean free paths", "way / (4V/S)")
    ends = [log2(0.5) - 0.3, log2(20) + 0.3]
    plot.band(ends, [0.995, 0.995], [1.005, 1.005], "\N{PLUS-MINUS SIGN} 0.5 %")
    plot.law(ends, [1, 1], "4V/S")
    for ink, (name, of) in enumerate(table.items()):
        bars(plot, [log2(sigma) + 0.05 * ink for sigma in of["sigma"]], [0.75 * y for y in of["measured"]],
             [0.75 * e for e in of["error"]], ink, name)
    return plot


def collisions(table):
    plot = Plot("Collisions of a photon in a half space: measured over (1 \N{MINUS SIGN} R) / (1 \N{MINUS SIGN} albedo)",
                "log\N{SUBSCRIPT ONE}\N{SUBSCRIPT ZERO} of 1 \N{MINUS SIGN} albedo", "measured / expected")
    plot.law([-3.1, -0.2], [1, 1], "expected")
    for ink, (name, of) in enumerate(table.items()):
        bars(plot, [log10(c) + 0.03 * ink for c in of["co_albedo"]], [m / e for m, e in zip(of["measured"], of["expected"])],
             [s / e for s, e in zip(of["error"], of["expected"])], ink, name)
    return plot


def furnace(table):
    plot = Plot("White furnace: a ball that absorbs nothing", "log\N{SUBSCRIPT ONE}\N{SUBSCRIPT ZERO} of extinction (1/m)", "radiance")
    plot.law([-0.5, 2.6], [1, 1], "1")
    for ink, (name, of) in enumerate(table.items()):
        bars(plot, [log10(s) + 0.05 * ink for s in of["sigma"]], of["measured"], of["error"], ink, name)
    return plot


def depth(table):
    plot = Plot("Light in deep snow, 300 kg/m\N{SUPERSCRIPT THREE}, spheres of 0.5 mm, Picard", "depth (cm)",
                "log\N{SUBSCRIPT TWO} of light, 0 at the surface by the law")
    for ink, (name, of) in enumerate(table.items()):
        plot.law(of["depth_cm"], [log2(e) for e in of["expected"]], None if ink else "exp(\N{MINUS SIGN}depth / e-folding)")
        plot.points(of["depth_cm"], [log2(m) for m in of["measured"]], ink, name)
    return plot


def glint_counts(table):
    plot = Plot("Facets that glint in a cone, of 10\N{SUPERSCRIPT FOUR} regions: Binomial(N, p)", "facets", "regions")
    for ink, (name, of) in enumerate(table.items()):
        plot.law(of["count"], of["expected"], None if ink else "binomial")
        plot.points(of["count"], of["measured"], ink, name.replace("cone of a facet: ", "") + "\N{DEGREE SIGN}")
    return plot


def glint_turn(table):
    return against_law(Plot("Glints that stay as the half vector turns", "turned by / two cones", "part that stays"), table, "part")


def glint_mean(table):
    plot = Plot("Mean of glints over the smooth microfacet BRDF", "radius of the light (degrees)", "ratio")
    plot.law([-0.2, 4.8], [1, 1], "smooth")
    for ink, (name, of) in enumerate(table.items()):
        bars(plot, [x + 0.04 * ink for x in of["light_degrees"]], of["measured"], of["error"], ink, name)
    return plot


def equal_time(table, scene, title):
    """Noise falls with the root of the time: a line through what was measured. `light` misses light in these scenes."""
    plot = Plot(title, "log\N{SUBSCRIPT ONE}\N{SUBSCRIPT ZERO} of time (s)", "log\N{SUBSCRIPT ONE}\N{SUBSCRIPT ZERO} of noise (RMSE / mean)")
    shown = [(name, of) for name, of in table.items() if name.startswith(f"{scene}:") and not name.endswith(":light")]
    for ink, (name, of) in enumerate(shown):
        at, noise = log10(of["seconds"][0]), log10(of["noise"][0])
        plot.line([at - 1, at + 1], [noise + 0.5, noise - 0.5], ink)
        plot.points([at], [noise], ink, name.split(":")[1])
    return plot


# Light that one path in a hundred thousand brings has no error bar of its own: as the test has it.
LEAST_ERROR = {"slab": 1e-4}

# The curve of each figure, and how it is drawn.
FIGURES = {
    "slab_reflects": ("slab", lambda of: slabs(of, "R_mu0_1", "Slabs of g = 0.75 lit from above: reflectance")),
    "slab_passes": ("slab", lambda of: slabs(of, "T_mu0_1", "Slabs of g = 0.75 lit from above: transmittance")),
    "slab_scores": ("slab", lambda of: histogram("Slabs: all reflectances and transmittances", scores(of, LEAST_ERROR["slab"]))),
    "half_space": ("half_space", half_space),
    "snow_natural": ("albedo", lambda of: snow_albedo(of, "B1.6_g0.845", "Deep snow of natural grains")),
    "snow_spheres": ("albedo", lambda of: snow_albedo(of, "mie_sphere", "Deep snow of spheres")),
    "bed": ("bed", bed),
    "depth": ("depth", depth),
    "way": ("way", way),
    "collisions": ("collisions", collisions),
    "furnace": ("furnace", furnace),
    "integrator_scores": ("integrators", lambda of: histogram("Blocks of pictures: path against bidirectional and light", scores(of))),
    "glint_counts": ("glint_counts", glint_counts),
    "glint_turn": ("glint_turn", glint_turn),
    "glint_mean": ("glint_mean", glint_mean),
}
TIMED = {"sun_on_slab": "Sun and sky on a slab", "ball_lit_from_behind": "A ball lit from behind",
         "lamp_in_cave": "A lamp in a cave of snow", "snowball_in_cornell_box": "A snowball in a Cornell box"}


def main(folder, out=OUT):
    """Draws the figures that there are curves of: tests may be run one by one. Returns the names of the others."""
    curves = {path.stem.removeprefix("light_"): read(path) for path in sorted(Path(folder).glob("light_*.csv"))}
    out.mkdir(exist_ok=True)
    left = []
    for name, (curve, draw) in FIGURES.items():
        if curves.get(curve):
            draw(curves[curve]).save(out / f"{name}.svg")
        else:
            left.append(name)
    timed = read(ROOT / "docs/figures/integrators.csv")
    for scene, title in TIMED.items():
        equal_time(timed, scene, title).save(out / f"time_{scene}.svg")
    for name, table in curves.items():
        if table and "error" in next(iter(table.values())):
            summary(name, scores(table, LEAST_ERROR.get(name, 1e-7)))
    print(f"{relpath(out, ROOT)}: {len(list(out.glob('*.svg')))} figures")
    return left


if __name__ == "__main__":
    source = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/figures")
    if not list(source.glob("light_*.csv")):
        sys.exit(f"no curves of light in {source}: run ./dev figures")
    main(source)

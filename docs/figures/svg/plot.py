# SPDX-License-Identifier: MIT
"""A plot as SVG text: axes with round ticks, lines, points, bands, boxes, a legend at the right. It brings its own paper,
light or dark as the reader's system is, so that ink and paper always fit. Needs nothing but Python, and the same data give the
same bytes."""
from html import escape
from math import ceil, floor, log10
from pathlib import Path

INK = ["#3f7fd0", "#d9822b", "#3d9a5f", "#cf4f5a", "#8a63c9", "#2f9da3", "#a1743c", "#7f8892"]  # on either paper
STYLE = """text{font:12px system-ui,"Segoe UI",Helvetica,Arial,sans-serif;fill:#2b3036}
.title{font-size:13px;font-weight:600}.paper{fill:#fff}.grid{stroke:#e6e9ec}.frame{stroke:#9aa2ab;fill:none}
.law{stroke:#2b3036;fill:none;stroke-width:1.3;stroke-dasharray:5 4}.band{fill:#7f8892;fill-opacity:.18}
@media(prefers-color-scheme:dark){text{fill:#d6dce2}.paper{fill:#161a1f}.grid{stroke:#2b3239}.frame{stroke:#66707a}
.law{stroke:#d6dce2}}"""
LEFT, TOP, BOTTOM, LEGEND = 62, 34, 46, 150  # px around the axes


def round_step(span, most):
    """The least of 1, 2, 5 x 10^n that cuts `span` into at most `most` parts."""
    power = 10.0 ** floor(log10(span / most))
    return next(step * power for step in (1, 2, 5, 10) if span / (step * power) <= most * (1 + 1e-9))


class Axis:
    def __init__(self, low, high, begin, end, ticks):
        step = round_step(high - low, ticks)
        self.decimals = max(0, -floor(log10(step) + 1e-9))
        first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
        self.ticks = [i * step for i in range(first, last + 1)]
        self.low, self.scale, self.begin = low, (end - begin) / (high - low), begin

    def at(self, value):
        return round(self.begin + (value - self.low) * self.scale, 1)

    def text(self, tick):
        return f"{tick + 0.0:.{self.decimals}f}".replace("-", "\N{MINUS SIGN}")


class Plot:
    """title; x, y: what the axes show, with units; x_range, y_range: where the data's own is not wanted."""

    def __init__(self, title, x, y, x_range=None, y_range=None, size=(640, 320)):
        self.title, self.labels, self.ranges, self.size = title, (x, y), [x_range, y_range], size
        self.marks, self.legend = [], []
        self.values = ([], [])

    def _add(self, kind, xs, ys, ink, label):
        xs, ys = list(xs), list(ys)
        self.values[0].extend(xs)
        self.values[1].extend(ys)
        self.marks.append((kind, xs, ys, ink))
        if label:
            self.legend.append((kind, ink, label))

    def line(self, xs, ys, ink=0, label=None):
        """What was measured, where the samples lie close."""
        self._add("line", xs, ys, ink, label)

    def points(self, xs, ys, ink=0, label=None):
        """What was measured, sample by sample."""
        self._add("points", xs, ys, ink, label)

    def law(self, xs, ys, label=None, ink=None):
        """What is expected; in the colour of what it is for, where there are several."""
        self._add("law", xs, ys, ink, label)

    def band(self, xs, low, high, label=None, ink=None):
        """What is allowed."""
        xs = list(xs)
        self._add("band", xs + xs[::-1], list(low) + list(high)[::-1], ink, label)

    def box(self, left, right, low, high, ink=0, label=None):
        self._add("box", (left, right), (low, high), ink, label)

    def save(self, path, y_names=None):
        """y_names: {value: text} instead of numbers at the ticks of y."""
        width, height = self.size
        x, y = (self._axis(0, LEFT, width - LEGEND - 12, 7), self._axis(1, height - BOTTOM, TOP, 6))
        parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
                 f'role="img" aria-label="{escape(self.title)}">', f"<style>{STYLE}</style>",
                 f'<rect class="paper" width="{width}" height="{height}" rx="6"/>',
                 f'<clipPath id="axes"><rect x="{LEFT}" y="{TOP}" width="{width - LEGEND - 12 - LEFT}" '
                 f'height="{height - BOTTOM - TOP}"/></clipPath>']
        parts += self._frame(x, y, y_names) + ['<g clip-path="url(#axes)">']
        parts += [mark_of(kind, [x.at(v) for v in xs], [y.at(v) for v in ys], ink) for kind, xs, ys, ink in self.marks]
        parts += ["</g>"] + self._legend() + ["</svg>"]
        Path(path).write_text("\n".join(parts) + "\n")

    def _axis(self, which, begin, end, ticks):
        values, given = self.values[which], self.ranges[which]
        low, high = given or (min(values), max(values))
        spare = 0 if given else 0.04 * (high - low or 1)
        return Axis(low - spare, high + spare, begin, end, ticks)

    def _frame(self, x, y, y_names):
        width, height = self.size
        right, foot = width - LEGEND - 12, height - BOTTOM
        out = [f'<text class="title" x="{LEFT}" y="21">{escape(self.title)}</text>']
        for tick in x.ticks:
            out += [f'<path class="grid" d="M{x.at(tick)} {TOP}V{foot}"/>',
                    f'<text x="{x.at(tick)}" y="{foot + 17}" text-anchor="middle">{x.text(tick)}</text>']
        for tick in (y_names or y.ticks):
            text = y_names[tick] if y_names else y.text(tick)
            out += [f'<path class="grid" d="M{LEFT} {y.at(tick)}H{right}"/>',
                    f'<text x="{LEFT - 7}" y="{y.at(tick) + 4:.1f}" text-anchor="end">{escape(text)}</text>']
        middle = (TOP + foot) / 2
        return out + [f'<rect class="frame" x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{foot - TOP}"/>',
                      f'<text x="{(LEFT + right) / 2}" y="{height - 11}" text-anchor="middle">{escape(self.labels[0])}</text>',
                      f'<text transform="translate(15 {middle})rotate(-90)" text-anchor="middle">'
                      f'{escape(self.labels[1])}</text>']

    def _legend(self):
        left, out = self.size[0] - LEGEND, []
        for row, (kind, ink, label) in enumerate(self.legend):
            at = TOP + 10 + 18 * row
            xs, ys = ([left, left + 20], [at, at])
            if kind == "band":
                xs, ys = [left, left + 20, left + 20, left], [at - 5, at - 5, at + 5, at + 5]
            elif kind == "points":
                xs, ys = [left + 10], [at]
            elif kind == "box":
                ys = [at - 5, at + 5]
            out += [mark_of(kind, xs, ys, ink), f'<text x="{left + 27}" y="{at + 4}">{escape(label)}</text>']
        return out


def mark_of(kind, xs, ys, ink):
    colour = INK[(ink or 0) % len(INK)]
    way = "M" + "L".join(f"{x} {y}" for x, y in zip(xs, ys))
    if kind == "line":
        return f'<path d="{way}" fill="none" stroke="{colour}" stroke-width="1.8" stroke-linejoin="round"/>'
    if kind == "points":
        return f'<g fill="{colour}">' + "".join(f'<circle cx="{x}" cy="{y}" r="2.7"/>' for x, y in zip(xs, ys)) + "</g>"
    if kind == "box":
        (left, right), (low, high) = sorted(xs), sorted(ys)
        return f'<rect x="{left}" y="{low}" width="{right - left:.1f}" height="{high - low:.1f}" fill="{colour}"/>'
    style = "" if ink is None else f' style="{"fill" if kind == "band" else "stroke"}:{colour}"'
    return f'<path class="{kind}"{style} d="{way}{"Z" if kind == "band" else ""}"/>'

"""Curves as SVG: a panel with ticks, marks, and a legend beside it."""

import math
import xml.sax.saxutils

WIDTH, HEIGHT, LEFT, TOP, LEGEND = 460, 320, 74, 40, 290
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c564b", "#999933", "#882255")
MARKS = (
    "<circle cx='{x:.1f}' cy='{y:.1f}' r='3.6' fill='{c}'/>",
    "<rect x='{x:.1f}' y='{y:.1f}' width='6.6' height='6.6' transform='translate(-3.3 -3.3)' fill='{c}'/>",
    "<path d='M{x:.1f},{y:.1f} m0,-4.4 l4.2,7.4 h-8.4 z' fill='{c}'/>",
    "<path d='M{x:.1f},{y:.1f} m0,-4.6 l4.6,4.6 l-4.6,4.6 l-4.6,-4.6 z' fill='{c}'/>",
)


class Axis:
    """Where values stand; logarithmic, or even from 0 (or from what is below it)."""

    def __init__(self, values, logarithmic, start, length):
        self.logarithmic, self.start, self.length = logarithmic, start, length
        scaled = [self.scaled(v) for v in values]
        self.low, self.high = min(scaled), max(scaled)
        if not logarithmic:
            self.low = min(self.low, 0)
        room = 0.04 * max(self.high - self.low, 0.5 if logarithmic else 1e-300)
        self.low -= room if logarithmic or self.low < 0 else 0
        self.high += room

    def scaled(self, value):
        return math.log10(value) if self.logarithmic else value

    def at(self, value):
        return self.start + (self.scaled(value) - self.low) / (self.high - self.low) * self.length

    def ticks(self):
        if self.logarithmic:
            for digits in ((1,), (1, 3), (1, 2, 5)):
                powers = range(math.floor(self.low), math.ceil(self.high) + 1)
                all_ticks = [d * 10.0**p for p in powers for d in digits if self.low <= math.log10(d * 10.0**p) <= self.high]
                if len(all_ticks) >= 3:
                    break
            return all_ticks[:: 1 + len(all_ticks) // 10]
        step = 10 ** math.floor(math.log10(self.high - self.low))
        for part in (2, 2.5, 2):
            if (self.high - self.low) / step < 4:
                step /= part
        return [k * step for k in range(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9) + 1)]


def number(value):
    """As a tick has it."""
    if value and not 1e-3 <= abs(value) < 1e6:
        return f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")
    return f"{value:,.6g}"


def curves(title, x_name, y_name, data, log_x=True, log_y=True, marks=True, level=None):
    """Curves [(name, [(x, y), ...]), ...] as the text of an SVG; points that a logarithm has not are left out.

    level is (name, y): a line across, such as what the report has.
    """
    escape = xml.sax.saxutils.escape
    good = lambda x, y: math.isfinite(x) and math.isfinite(y) and (x > 0 or not log_x) and (y > 0 or not log_y)
    data = [(name, [p for p in points if good(*p)]) for name, points in data]
    data = [(name, points) for name, points in data if points]
    if not data:
        raise ValueError(f"no points for '{title}'")
    xs = [p[0] for _, points in data for p in points]
    ys = [p[1] for _, points in data for p in points] + ([level[1]] if level else [])
    x, y = Axis(xs, log_x, LEFT, WIDTH), Axis(ys, log_y, TOP + HEIGHT, -HEIGHT)
    right, bottom = LEFT + WIDTH, TOP + HEIGHT
    width, height = right + LEGEND, max(bottom + 56, TOP + 20 * len(data) + 20)
    out = [
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' viewBox='0 0 {width} {height}' "
        "font-family='sans-serif' font-size='12'>",
        "<rect width='100%' height='100%' fill='white'/>",
        f"<text x='{LEFT}' y='24' font-size='14'>{escape(title)}</text>",
    ]
    for tick in x.ticks():
        out.append(f"<path d='M{x.at(tick):.1f},{TOP} V{bottom}' stroke='#ddd'/>")
        out.append(f"<text text-anchor='middle' x='{x.at(tick):.1f}' y='{bottom + 18}'>{number(tick)}</text>")
    for tick in y.ticks():
        out.append(f"<path d='M{LEFT},{y.at(tick):.1f} H{right}' stroke='#ddd'/>")
        out.append(f"<text text-anchor='end' x='{LEFT - 6}' y='{y.at(tick) + 4:.1f}'>{number(tick)}</text>")
    out.append(f"<rect x='{LEFT}' y='{TOP}' width='{WIDTH}' height='{HEIGHT}' fill='none' stroke='#888'/>")
    if level:
        out.append(f"<path d='M{LEFT},{y.at(level[1]):.1f} H{right}' stroke='#444' stroke-dasharray='6 4'/>")
        out.append(f"<text x='{right + 10}' y='{y.at(level[1]) + 4:.1f}' fill='#444'>{escape(level[0])}</text>")
    for k, (name, points) in enumerate(data):
        colour = COLOURS[k % len(COLOURS)]
        places = [(x.at(a), y.at(b)) for a, b in points]
        line = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
        out.append(f"<polyline points='{line}' fill='none' stroke='{colour}' stroke-width='1.6'/>")
        if marks:
            out += [MARKS[k % len(MARKS)].format(x=a, y=b, c=colour) for a, b in places]
        row = TOP + 8 + 18 * k + (18 if level and abs(TOP + 8 + 18 * k - y.at(level[1])) < 12 else 0)
        out.append(MARKS[k % len(MARKS)].format(x=right + 16, y=row, c=colour))
        out.append(f"<text x='{right + 26}' y='{row + 4}'>{escape(name)}</text>")
    out.append(f"<text text-anchor='middle' x='{LEFT + WIDTH / 2}' y='{bottom + 40}'>{escape(x_name)}</text>")
    out.append(
        f"<text text-anchor='middle' transform='translate(16 {TOP + HEIGHT / 2}) rotate(-90)'>{escape(y_name)}</text></svg>"
    )
    return "\n".join(out) + "\n"


def bars(title, panels):
    """Lengths from a mark, on a logarithm unless that is 0: panels [(name of the axis, [(line, beside it, value), ...], mark), ...] below each other."""
    escape = xml.sax.saxutils.escape
    left, row = 530, 20
    out, top = [], 40
    for name, lines, mark in panels:
        axis = Axis([value for *_, value in lines] + [mark or 1], mark > 0, left, WIDTH)
        bottom = top + row * len(lines) + 8
        for tick in axis.ticks():
            out.append(f"<path d='M{axis.at(tick):.1f},{top} V{bottom}' stroke='#ddd'/>")
            out.append(f"<text text-anchor='middle' x='{axis.at(tick):.1f}' y='{bottom + 16}'>{number(tick)}</text>")
        for k, (line, beside, value) in enumerate(lines):
            y, a, b = top + 6 + row * k, axis.at(mark), axis.at(value)
            out.append(f"<rect x='{min(a, b):.1f}' y='{y}' width='{abs(b - a):.1f}' height='13' fill='{COLOURS[0] if value >= mark else COLOURS[1]}'/>")
            out.append(f"<text text-anchor='end' x='{left - 8}' y='{y + 11}'>{escape(line)} <tspan fill='#555'>{escape(beside)}</tspan></text>")
            out.append(f"<text x='{left + WIDTH + 8}' y='{y + 11}'>{value:.3g}</text>")
        out.append(f"<path d='M{axis.at(mark):.1f},{top} V{bottom}' stroke='#444'/>")
        out.append(f"<text text-anchor='middle' x='{left + WIDTH / 2}' y='{bottom + 34}'>{escape(name)}</text>")
        top = bottom + 56
    width = left + WIDTH + 60
    head = [
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{top}' viewBox='0 0 {width} {top}' font-family='sans-serif' font-size='12'>",
        "<rect width='100%' height='100%' fill='white'/>",
        f"<text x='8' y='24' font-size='14'>{escape(title)}</text>",
    ]
    return "\n".join(head + out) + "</svg>\n"


def front_faces(path, window, pixels=360):
    """The triangles of an OBJ file that look to the front (-y), from back to front, as the text of an SVG.

    window: the smallest x and z that are seen, the width and the height, mm.
    """
    points, faces = [], []
    with open(path) as file:
        for line in file:
            words = line.split()
            if words and words[0] == "v":
                points.append(tuple(map(float, words[1:4])))
            elif words and words[0] == "f":
                faces.append([points[int(word.split("/")[0]) - 1] for word in words[1:4]])
    left, low, width, height = window
    scale = pixels / width
    out = [
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{pixels}' height='{round(scale * height)}' viewBox='0 0 {pixels} {round(scale * height)}'>",
        "<rect width='100%' height='100%' fill='white'/><g fill='#f4e3dc' stroke='#202020' stroke-width='0.7' stroke-linejoin='round'>",
    ]
    for face in sorted(faces, key=lambda f: -sum(p[1] for p in f)):
        flat = [(scale * (x - left), scale * (low + height - z)) for x, _, z in face]
        (ax, ay), (bx, by), (cx, cy) = flat
        seen = all(min(p[k] for p in flat) < limit and max(p[k] for p in flat) > 0 for k, limit in ((0, pixels), (1, scale * height)))
        if seen and (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0:
            out.append("<path d='M" + " L".join(f"{x:.1f},{y:.1f}" for x, y in flat) + "Z'/>")
    return "\n".join(out) + "\n</g></svg>\n"

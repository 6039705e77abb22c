"""Meshes, models, scenes and answers for programs that judge contact from outside.

A scene is built from meshes that are made here, run by `ffe-run`, and read back from its text answers. Nothing of the
library is used, so that any implementation can be judged. Units: mm, g, s; forces in 1e-6 N. The standard library
suffices; `ipctk` (PyPI) finds intersections where it is installed.
"""

import json
import math
import os
import pathlib
import resource
import signal
import subprocess
import time
from fractions import Fraction

GRAVITY = 9810.0  # mm/s2

# --- Vectors ------------------------------------------------------------------------------------------------------------


def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(s, a):
    return (s * a[0], s * a[1], s * a[2])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a):
    return math.sqrt(dot(a, a))


def total(vectors):
    """Sum that is exact up to one rounding per axis."""
    vectors = list(vectors)
    return tuple(math.fsum(v[k] for v in vectors) for k in range(3))


# --- Meshes: (points, cells), cells with positive volume ----------------------------------------------------------------


def grid(counts, place):
    """Kuhn's six tetrahedra in each cell of a grid; `place(i, j, k)` is the position of a grid point."""
    nx, ny, nz = counts
    index = lambda i, j, k: (k * (ny + 1) + j) * (nx + 1) + i
    points = [place(i, j, k) for k in range(nz + 1) for j in range(ny + 1) for i in range(nx + 1)]
    cells = []
    for k in range(nz):
        for j in range(ny):
            for i in range(nx):
                q = [index(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2 & 1)) for b in range(8)]
                cells += [(q[0], q[a], q[b], q[7]) for a, b in ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))]
    return oriented(points, cells)


def oriented(points, cells):
    out = []
    for a, b, c, d in cells:
        p = points[a]
        volume = dot(cross(sub(points[b], p), sub(points[c], p)), sub(points[d], p))
        out.append((a, b, c, d) if volume > 0 else (a, c, b, d))
    return points, out


def box(counts, size, corner, degrees=0.0):
    """Box of tetrahedra from its lowest corner, turned about the vertical line through its middle."""
    angle, middle = math.radians(degrees), (corner[0] + size[0] / 2, corner[1] + size[1] / 2)
    c, s = math.cos(angle), math.sin(angle)

    def place(i, j, k):
        x, y, z = (corner[a] + size[a] * n / counts[a] for a, n in enumerate((i, j, k)))
        if not degrees:
            return (x, y, z)
        x, y = x - middle[0], y - middle[1]
        return (middle[0] + c * x - s * y, middle[1] + s * x + c * y, z)

    return grid(counts, place)


def ball(cells, radius, centre, axes=(1, 1, 1), degrees=0.0):
    """A cube of cells pushed out to a ball, turned by `degrees` about (1, 2, 3)."""

    def place(i, j, k):
        p = tuple(2.0 * n / cells - 1 for n in (i, j, k))
        length = norm(p)
        p = scale(max(map(abs, p)) / length if length else 0, p)
        p = turned(p, (1, 2, 3), degrees) if degrees else p
        return tuple(c + radius * a * x for c, a, x in zip(centre, axes, p))

    return grid((cells, cells, cells), place)


def turned(p, axis, degrees):
    """Rodrigues' formula."""
    k, angle = scale(1 / norm(axis), axis), math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    return add(add(scale(c, p), scale(s, cross(k, p))), scale(dot(k, p) * (1 - c), k))


def mapped(mesh, f):
    points, cells = mesh
    return oriented([f(p) for p in points], cells)


def sheet(nx, ny, place):
    """Triangles of a grid, diagonals in turns; `place(i, j)`."""
    points = [place(i, j) for j in range(ny + 1) for i in range(nx + 1)]
    triangles = []
    for j in range(ny):
        for i in range(nx):
            a = j * (nx + 1) + i
            b, c, d = a + 1, a + nx + 1, a + nx + 2
            triangles += [(a, b, d), (a, d, c)] if (i + j) % 2 == 0 else [(a, b, c), (b, d, c)]
    return points, triangles


def tube(around, along, radius, length, start=(0, 0, 0)):
    """Open tube of triangles along x."""
    points = []
    for j in range(along + 1):
        for i in range(around):
            angle = 2 * math.pi * (i + 0.5 * (j % 2)) / around
            points.append(add(start, (length * j / along, radius * math.cos(angle), radius * math.sin(angle))))
    triangles = []
    for j in range(along):
        for i in range(around):
            a, b = j * around + i, j * around + (i + 1) % around
            c, d = a + around, b + around
            triangles += [(a, b, c), (b, d, c)] if j % 2 == 0 else [(a, d, c), (a, b, d)]
    return points, [(a, c, b) for a, b, c in triangles]


def medit(mesh):
    points, cells = mesh
    lines = ["MeshVersionFormatted 2", "Dimension 3", "Vertices", str(len(points))]
    lines += ["%r %r %r 0" % tuple(map(float, p)) for p in points]
    lines += ["Tetrahedra", str(len(cells))] + ["%d %d %d %d 1" % tuple(n + 1 for n in c) for c in cells] + ["End", ""]
    return "\n".join(lines)


def obj(mesh):
    points, triangles = mesh
    return "".join("v %r %r %r\n" % tuple(map(float, p)) for p in points) + "".join(
        "f %d %d %d\n" % tuple(n + 1 for n in t) for t in triangles
    )


def ply(points, triangles):
    rows = ["%r %r %r" % tuple(map(float, p)) for p in points] + ["3 %d %d %d" % tuple(t) for t in triangles]
    head = ["ply", "format ascii 1.0", f"element vertex {len(points)}"] + [f"property double {a}" for a in "xyz"]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header"]
    return "\n".join(head + rows) + "\n"


def plate(size):
    """Points and triangles of a box about the origin, for `instrument NAME mesh`."""
    points = [tuple((2 * (b >> a & 1) - 1) * size[a] / 2 for a in range(3)) for b in range(8)]
    faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return points, [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]


# --- Models -------------------------------------------------------------------------------------------------------------


class Model:
    """What is needed of a model in the form of ela_expl(5)."""

    def __init__(self, path):
        self.path, self.rest, self.mass, self.fixed, self.triangles, self.tetrahedra = path, [], [], [], [], 0
        lines = iter(pathlib.Path(path).read_text().splitlines())
        for line in lines:
            words = line.split()
            if not words:
                continue
            if words[0] == "nodes":
                for _ in range(int(words[1])):
                    w = next(lines).split()
                    self.rest.append((float(w[0]), float(w[1]), float(w[2])))
                    self.mass.append(float(w[3]))
                    self.fixed.append(w[5] != "-")
            elif words[0] == "triangles":
                self.triangles = [tuple(map(int, next(lines).split())) for _ in range(int(words[1]))]
            elif words[0] == "tetrahedra":
                self.tetrahedra = int(words[1])
        self.weight = math.fsum(self.mass)

    def where(self, test):
        """Numbers of the nodes whose position at rest passes the test."""
        return [i for i, p in enumerate(self.rest) if test(p)]

    def centre(self, shape=None):
        return scale(1 / self.weight, total(scale(m, p) for m, p in zip(self.mass, shape or self.rest)))


# --- Scenes -------------------------------------------------------------------------------------------------------------


class Failure(Exception):
    """A program that ended badly or took too long."""


class Frame:
    """Answer to one step."""

    def __init__(self, at):
        self.time, self.forces, self.shapes, self.triangles, self.instruments, self.words = at, {}, {}, {}, {}, []


def frames_of(lines):
    lines = iter(lines)
    frame = None
    for line in lines:
        words = line.split()
        head = words[0] if words else ""
        if head == "step":
            frame = Frame(float(words[2]))
        elif head == "forces":
            rows = (next(lines).split() for _ in range(int(words[2])))
            frame.forces[words[1]] = {int(r[0]): (float(r[1]), float(r[2]), float(r[3])) for r in rows}
        elif head == "shapes":
            rows = (next(lines).split() for _ in range(int(words[2])))
            frame.shapes[words[1]] = [(float(r[0]), float(r[1]), float(r[2])) for r in rows]
        elif head == "triangles":
            frame.triangles[words[1]] = [tuple(map(int, next(lines).split())) for _ in range(int(words[2]))]
        elif head == "instruments":
            for _ in range(int(words[1])):
                row = next(lines).split()
                v = tuple(map(float, row[1:]))
                frame.instruments[row[0]] = (v[0:3], v[3:6], v[6:9])
        elif head == "done":
            yield frame
        elif frame is not None:
            frame.words.append(line)


class Scene:
    """A folder with models and a scene; `run` carries it out."""

    def __init__(self, folder, programs, order=2, dt=1 / 600):
        self.folder, self.programs, self.order, self.dt = pathlib.Path(folder), pathlib.Path(programs), order, dt
        self.folder.mkdir(parents=True, exist_ok=True)
        self.models, self.lines, self.pairs, self.free_pairs = {}, [], [], True
        self.options, self.cpu, self.memory, self.stats = [], 0.0, 0.0, {}
        self.line("timestep %r" % dt)

    def program(self, name, *words, limit=60):
        end = subprocess.run([str(self.programs / name), *map(str, words)], cwd=self.folder, capture_output=True, text=True,
                             timeout=limit)
        if end.returncode:
            raise Failure(f"{name}: {end.stderr.strip().splitlines()[-1] if end.stderr.strip() else end.returncode}")

    def solid(self, name, mesh, young, poisson=0.3, density=1e-3, drag=0.0, fix=None, axes=None, words="", order=None, more=()):
        """Adds a solid; `fix` is a selector, or a list of (selector, axes)."""
        (self.folder / f"{name}.mesh").write_text(medit(mesh))
        options = ["-q", f"{name}.mesh", "--unit", "mm", "--young", young, "--poisson", poisson, "--density", density,
                   "--drag", drag, "--order", order or self.order, "--name", name]
        self.held(name, options + list(more), fix, axes)
        return self.object(name, words)

    def net(self, name, mesh, young=1e5, thickness=0.5, density=1e-3, drag=1.0, fix=None, axes=None, words="integration=implicit",
            bend=True, centrals=0):
        (self.folder / f"{name}.obj").write_text(obj(mesh))
        options = ["-q", f"{name}.obj", "--unit", "mm", "--young", young, "--thickness", thickness, "--density", density,
                   "--drag", drag, "--centrals", centrals, "--name", name] + (["--bend"] if bend else [])
        self.held(name, options, fix, axes)
        return self.object(name, words)

    def held(self, name, options, fix, axes):
        fixes = fix if isinstance(fix, list) else [(fix, axes or "xyz")] if fix else []
        for k, (selector, along) in enumerate(fixes or [(None, None)]):
            held = ["--fix", selector, "--fix-axes", along] if selector else []
            source = options if k == 0 else ["-q", f"{name}.ela"]
            self.program("exp2ela", *source, *held, "-o", f"{name}.part.ela")
            os.replace(self.folder / f"{name}.part.ela", self.folder / f"{name}.ela")

    def object(self, name, words=""):
        self.models[name] = Model(self.folder / f"{name}.ela")
        self.line(f"object {name} {name}.ela {words}".rstrip())
        return self.models[name]

    def mesh_instrument(self, name, body, place, words=""):
        (self.folder / f"{name}.ply").write_text(ply(*body))
        self.line(f"instrument {name} mesh {name}.ply radius=0.5 {words_of(place)} {words}".rstrip())

    def line(self, text):
        self.lines.append(text)

    def contact(self, a, b, friction=0.0):
        self.pairs.append((a, b))
        self.line(f"contact {a} {b}" + (f" friction {friction!r}" if friction else ""))

    def gravity(self, degrees=0.0, towards=(1, 0), size=GRAVITY):
        """As on a slope that falls by `degrees` towards a horizontal direction."""
        s, c = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
        self.line("gravity %r %r %r" % (size * s * towards[0], size * s * towards[1], -size * c))

    def steps(self, duration, every=None):
        """Steps of the scene, of one integration step each or of `every` seconds; returns how many."""
        length = every or self.dt
        count = max(1, round(duration / length))
        self.lines += ["step" if every is None else "step %r" % length] * count
        return count

    def emit(self, *what):
        self.lines += [f"emit {w}" for w in what]

    def write(self):
        (self.folder / "scene.scene").write_text("\n".join(self.lines) + "\n")

    def run(self, limit=60.0):
        """Answers of all steps. Raises Failure where the run ends badly, or is not done within `limit` seconds of processor time."""
        self.write()
        began = time.monotonic()
        bound = lambda: resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limit), math.ceil(limit) + 5))
        command = [str(self.programs / "ffe-run"), "-j1", f"--stats={self.folder}/stats.json", *self.options, "scene.scene"]
        with open(self.folder / "answers.txt", "w") as out, open(self.folder / "errors.txt", "w") as err:
            process = subprocess.Popen(command, cwd=self.folder, stdout=out, stderr=err, start_new_session=True, preexec_fn=bound)
            try:
                _, status, usage = wait(process, 10 * limit + 60)  # for a process that sleeps
            finally:
                if process.returncode is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
        self.cpu, self.memory = (usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024) if usage else (time.monotonic() - began, 0)
        with open(self.folder / "answers.txt") as answers:
            frames = list(frames_of(line.rstrip("\n") for line in answers))
        errors = (self.folder / "errors.txt").read_text().strip().splitlines()
        self.warnings = [e for e in errors if "warning" in e.lower()]
        if status is None or status == -signal.SIGXCPU:
            raise Failure(f"not done within {limit:g} s of processor time: {frames[-1].time if frames else 0:g} s of the scene")
        if status:
            raise Failure(f"status {status}: {errors[-1] if errors else ''}")
        try:
            self.stats = json.loads((self.folder / "stats.json").read_text())
        except (OSError, ValueError):
            self.stats = {}
        return frames


def wait(process, limit):
    """Waits for a process: (pid, exit status or None, resource usage)."""
    end = time.monotonic() + limit
    pause = 0.002
    while time.monotonic() < end:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return pid, process.returncode, usage
        time.sleep(pause)
        pause = min(0.05, 1.5 * pause)
    os.killpg(process.pid, signal.SIGKILL)
    _, _, usage = os.wait4(process.pid, 0)
    process.returncode = -9
    return process.pid, None, usage


def words_of(*values):
    out = []
    for v in values:
        out += [repr(float(x)) for x in v] if isinstance(v, (tuple, list)) else [repr(float(v))]
    return " ".join(out)


# --- What every scene must keep -----------------------------------------------------------------------------------------


def orientation(a, b, c, d):
    """Sign of the volume of a tetrahedron: in floating point where that is certain, else exactly (Shewchuk 1997)."""
    ax, ay, az = a[0] - d[0], a[1] - d[1], a[2] - d[2]
    bx, by, bz = b[0] - d[0], b[1] - d[1], b[2] - d[2]
    cx, cy, cz = c[0] - d[0], c[1] - d[1], c[2] - d[2]
    t1, t2, t3, t4, t5, t6 = bx * cy, cx * by, cx * ay, ax * cy, ax * by, bx * ay
    value = az * (t1 - t2) + bz * (t3 - t4) + cz * (t5 - t6)
    bound = 8e-16 * ((abs(t1) + abs(t2)) * abs(az) + (abs(t3) + abs(t4)) * abs(bz) + (abs(t5) + abs(t6)) * abs(cz))
    if abs(value) > bound:
        return 1 if value > 0 else -1
    p, q, r, s = ([Fraction(x) for x in v] for v in (a, b, c, d))
    u, v, w = ([x - y for x, y in zip(e, s)] for e in (p, q, r))
    exact = u[2] * (v[0] * w[1] - w[0] * v[1]) + v[2] * (w[0] * u[1] - u[0] * w[1]) + w[2] * (u[0] * v[1] - v[0] * u[1])
    return (exact > 0) - (exact < 0)


def passes_through(p, q, a, b, c):
    """Whether a segment passes through a triangle's inside, by exact signs; what merely touches does not pass."""
    above, below = orientation(a, b, c, p), orientation(a, b, c, q)
    if above * below >= 0:
        return False
    s = (orientation(p, q, a, b), orientation(p, q, b, c), orientation(p, q, c, a))
    return all(x > 0 for x in s) or all(x < 0 for x in s)


def edges_of(triangles):
    return sorted({(min(t[k], t[k - 1]), max(t[k], t[k - 1])) for t in triangles for k in range(3)})


def surfaces(models, shapes, changed):
    """One mesh of all objects: points, triangles, and the object of each point."""
    points, triangles, owner = [], [], []
    known = [(name, shape) for name, shape in shapes.items() if name in changed or name in models]
    for k, (name, shape) in enumerate(known):
        base = len(points)
        points += shape
        owner += [k] * len(shape)
        triangles += [tuple(n + base for n in t) for t in (changed[name] if name in changed else models[name].triangles)]
    return points, triangles, owner


def who_touches(names, pairs):
    """Table (i, j) -> whether contact was asked for; parts NAME.1 touch as NAME does, and each other as NAME touches itself."""
    roots, asked = [n.split(".")[0] for n in names], {frozenset(p) for p in pairs}
    wanted = lambda i, j: frozenset((roots[i], roots[j]) if roots[i] != roots[j] else (roots[i], "self"))
    return {(i, j): wanted(i, j) in asked for i in range(len(names)) for j in range(len(names))}


def intersect(models, frame, changed, pairs):
    """Whether surfaces of an answer intersect that are to touch each other. `changed`: triangles of objects, as told so far."""
    points, triangles, owner = surfaces(models, frame.shapes, changed)
    table = who_touches([n for n in frame.shapes if n in changed or n in models], pairs)
    return has_intersections(points, triangles, owner, lambda i, j: table[i, j])


try:
    import ipctk
    import numpy

    ipctk.set_num_threads(1)
    ipctk.set_logger_level(ipctk.LoggerLevel.off)
except ImportError:
    ipctk = None


def has_intersections(points, triangles, owner, between):
    """Whether an edge passes through a triangle, of the objects that `between(i, j)` names."""
    if not triangles:
        return False
    if ipctk:
        used = sorted({n for t in triangles for n in t})
        number = {n: k for k, n in enumerate(used)}
        edges = numpy.array([[number[a], number[b]] for a, b in edges_of(triangles)], dtype=numpy.int32, order="F")
        faces = numpy.array([[number[n] for n in t] for t in triangles], dtype=numpy.int32, order="F")
        rest = numpy.array([points[n] for n in used], order="F")
        mesh = ipctk.CollisionMesh(rest, edges, faces)
        whose = [owner[n] for n in used]
        mesh.can_collide = lambda i, j: between(whose[i], whose[j])
        if not ipctk.has_intersections(mesh, rest):
            return False
    return any_passes(points, triangles, owner, between)  # ipctk counts touching as well: exact signs decide


def any_passes(points, triangles, owner, between):
    edges = edges_of(triangles)
    boxes = []
    for t in triangles:
        p = [points[n] for n in t]
        boxes.append((tuple(min(x[a] for x in p) for a in range(3)), tuple(max(x[a] for x in p) for a in range(3))))
    size = max(1e-12, sum(b[1][0] - b[0][0] + b[1][1] - b[0][1] + b[1][2] - b[0][2] for b in boxes) / len(boxes) / 2)
    cells = {}
    span = lambda low, high: [(i, j, k) for i in range(math.floor(low[0] / size), math.floor(high[0] / size) + 1)
                              for j in range(math.floor(low[1] / size), math.floor(high[1] / size) + 1)
                              for k in range(math.floor(low[2] / size), math.floor(high[2] / size) + 1)]
    for n, (low, high) in enumerate(boxes):
        for key in span(low, high):
            cells.setdefault(key, []).append(n)
    for a, b in edges:
        p, q = points[a], points[b]
        low, high = tuple(map(min, p, q)), tuple(map(max, p, q))
        seen = set()
        for key in span(low, high):
            for n in cells.get(key, ()):
                if n in seen:
                    continue
                seen.add(n)
                t = triangles[n]
                if a in t or b in t or not between(owner[a], owner[t[0]]):
                    continue
                l, h = boxes[n]
                if any(high[x] < l[x] or low[x] > h[x] for x in range(3)):
                    continue
                if passes_through(p, q, *(points[m] for m in t)):
                    return True
    return False


def distance_to_triangle(p, a, b, c):
    """Ericson, Real-time collision detection, 2005, section 5.1.5."""
    ab, ac, ap = sub(b, a), sub(c, a), sub(p, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0 and d2 <= 0:
        return norm(ap)
    bp = sub(p, b)
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0 and d4 <= d3:
        return norm(bp)
    vc = d1 * d4 - d3 * d2
    if vc <= 0 <= d1 and d3 <= 0:
        return norm(sub(p, add(a, scale(d1 / (d1 - d3), ab))))
    cp = sub(p, c)
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0 and d5 <= d6:
        return norm(cp)
    vb = d5 * d2 - d1 * d6
    if vb <= 0 <= d2 and d6 <= 0:
        return norm(sub(p, add(a, scale(d2 / (d2 - d6), ac))))
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        return norm(sub(p, add(b, scale((d4 - d3) / ((d4 - d3) + (d5 - d6)), sub(c, b)))))
    w = 1 / (va + vb + vc)
    return norm(sub(p, add(a, add(scale(vb * w, ab), scale(vc * w, ac)))))


def between_segments(p, q, a, b):
    """Distance of two segments (Ericson 2005, section 5.1.9)."""
    u, v, r = sub(q, p), sub(b, a), sub(p, a)
    uu, vv, f, c, w = dot(u, u), dot(v, v), dot(v, r), dot(u, r), dot(u, v)
    if uu == 0:
        t = min(1, max(0, f / vv)) if vv else 0
        return norm(sub(p, add(a, scale(t, v))))
    by = uu * vv - w * w
    s = min(1, max(0, (w * f - c * vv) / by)) if by > 1e-30 else 0
    t = (w * s + f) / vv if vv else 0
    if t < 0:
        t, s = 0, min(1, max(0, -c / uu))
    elif t > 1:
        t, s = 1, min(1, max(0, (w - c) / uu))
    return norm(sub(add(p, scale(s, u)), add(a, scale(t, v))))


def distance_to_segment(p, q, shape, triangles):
    """Least distance of a segment, or of a point p = q, and triangles; 0 where the segment passes through one."""
    least = math.inf
    for t in triangles:
        a, b, c = (shape[n] for n in t)
        if p != q:
            if passes_through(p, q, a, b, c):
                return 0.0
            least = min(least, *(between_segments(p, q, *e) for e in ((a, b), (b, c), (c, a))), distance_to_triangle(q, a, b, c))
        least = min(least, distance_to_triangle(p, a, b, c))
    return least

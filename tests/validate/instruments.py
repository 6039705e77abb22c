#!/usr/bin/env python3
"""Random instruments on organs, judged by what ffe-run answers alone.

  instruments.py [--count N] [--seed S] [--data FOLDER] [--keep FOLDER] [--only WORD] [--meshes]

Spheres, capsules and convex meshes from half an edge up, with and without friction, are pressed into organs and drawn along
them, by both methods. From each answer (forces, shapes, instruments) this script finds for itself, by its own geometry,

  depth            how deep the surface is in the instrument, over its radius
  cone             how far the forces at nodes are from any sum of pushes within the cones of friction at the points where
                   the surface touches the instrument, over all of them: a pull, or a drag too large
  apart            the share of forces at nodes of no triangle that touches (complementarity)
  sum              by how much the instrument feels other than the opposite of what it does

and prints the worst of each body, and each case that breaks a bound or fails with the scene that shows it, which stays in
the folder. A run that ends with status 1 after a warning of a shape beyond the linear range is counted as refused. Of what moves, depth and sum are judged at each step, the others in steps of one integration step, whose forces
are not means. Programs are found by $PATH; real organs in FOLDER, else models are made. Ends with status 1 where a bound
is broken or a run fails.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

TOUCH = 6.01e-4  # of the radius: so near is touched, so deep is inside; the activation distance is 1e-3 at most (gewebe-contact(7))
LAG = 1e-3  # of the force: to this, friction is that of the normal forces that are told (contact_friction_residual, there)
LONG = 60  # s that a scene may take


# --- Geometry: distances of triangles from a segment ------------------------------------------------------------------


def dot(a, b):
    return np.einsum("...k,...k->...", a, b)


def on_segment(p, a, b):
    """The share of the way from a to b that is nearest to p."""
    ab = b - a
    along, length = np.broadcast_arrays(dot(p - a, ab), dot(ab, ab))
    return np.clip(np.divide(along, length, out=np.zeros(along.shape), where=length > 0), 0, 1)


def on_triangles(p, t):
    """Weights of the points of triangles t (n x 3 x 3) that are nearest to p: the foot if it is inside, else the
    nearest of the edges' points."""
    a, b, c = t[:, 0], t[:, 1], t[:, 2]
    normal = np.cross(b - a, c - a)
    area = dot(normal, normal)
    weights = np.stack([dot(np.cross(c - b, p - b), normal), dot(np.cross(a - c, p - c), normal),
                        dot(np.cross(b - a, p - a), normal)], axis=1)
    inside = (weights.min(axis=1) >= 0) & (area > 0)
    best = np.full(len(t), np.inf)
    found = np.zeros((len(t), 3))
    for i, j in ((0, 1), (1, 2), (2, 0)):
        s = on_segment(p, t[:, i], t[:, j])
        w = np.zeros((len(t), 3))
        w[:, i], w[:, j] = 1 - s, s
        far = np.linalg.norm(np.einsum("nk,nkd->nd", w, t) - p, axis=1)
        nearer = far < best
        best[nearer], found[nearer] = far[nearer], w[nearer]
    found[inside] = weights[inside] / area[inside, None]
    return found


def between_segments(a, b, c, d):
    """Shares of the ways a-b and c-d at the lines' nearest points, NaN where they are parallel or these not between."""
    u, v, r = b - a, d - c, a - c
    uu, uv, vv, ur, vr = dot(u, u), dot(u, v), dot(v, v), dot(u, r), dot(v, r)
    by = uu * vv - uv * uv
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = (uv * vr - vv * ur) / by, (uu * vr - uv * ur) / by
    outside = ~((by > 1e-12 * uu * vv) & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1))
    s[outside], t[outside] = np.nan, np.nan
    return s, t


def near_points(corners, a, b):
    """Pairs of nearest points of triangles and the segment a-b: index of the triangle, weights, point of the segment."""
    n = len(corners)
    every = np.arange(n)
    index, weights, cores = [], [], []

    def add(which, w, core):
        index.append(which)
        weights.append(w)
        cores.append(np.broadcast_to(core, (len(which), 3)))

    add(every, on_triangles(a, corners), a)
    if not np.array_equal(a, b):
        add(every, on_triangles(b, corners), b)
        for i in range(3):  # corners and the segment
            s = on_segment(corners[:, i], np.broadcast_to(a, (n, 3)), np.broadcast_to(b, (n, 3)))
            w = np.zeros((n, 3))
            w[:, i] = 1
            add(every, w, a + s[:, None] * (b - a))
        for end in (a, b):  # ends of the segment and edges: where the nearest points of both edges are at such an end
            for i, j in ((0, 1), (1, 2), (2, 0)):
                s = on_segment(np.broadcast_to(end, (n, 3)), corners[:, i], corners[:, j])
                w = np.zeros((n, 3))
                w[:, i], w[:, j] = 1 - s, s
                add(every, w, end)
        for i, j in ((0, 1), (1, 2), (2, 0)):  # edges and the segment
            s, t = between_segments(np.broadcast_to(a, (n, 3)), np.broadcast_to(b, (n, 3)), corners[:, i], corners[:, j])
            there = ~np.isnan(s)
            w = np.zeros((there.sum(), 3))
            w[:, i], w[:, j] = 1 - t[there], t[there]
            add(every[there], w, a + s[there, None] * (b - a))
        # the segment through a triangle: distance 0
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        rate = dot(normal, b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = dot(normal, corners[:, 0] - a) / rate
        for k in np.flatnonzero((s >= 0) & (s <= 1)):
            p = a + s[k] * (b - a)
            w = on_triangles(p, corners[k : k + 1])
            if np.linalg.norm(w[0] @ corners[k] - p) < 1e-9 * np.linalg.norm(b - a):
                add(every[k : k + 1], w, p)
    return np.concatenate(index), np.concatenate(weights), np.concatenate(cores)


# --- Geometry: convex meshes --------------------------------------------------------------------------------------------


class Hull:
    """The triangles around points, of which each is a corner."""

    def __init__(self, points):
        count, faces = len(points), []
        for i in range(count):
            for j in range(i + 1, count):
                for k in range(j + 1, count):
                    normal = np.cross(points[j] - points[i], points[k] - points[i])
                    height = np.delete((points - points[i]) @ normal, [i, j, k])
                    if height.max() < 0:
                        faces.append((i, j, k))
                    elif height.min() > 0:
                        faces.append((i, k, j))
        self.faces = np.array(faces)
        used = np.unique(self.faces)
        self.points, self.faces = points[used], np.searchsorted(used, self.faces)
        self.edges = np.array(sorted({tuple(sorted((int(f[k]), int(f[k - 1])))) for f in self.faces for k in range(3)}))

    def text(self):
        rows = [numbers(p) for p in self.points] + ["3 " + " ".join(map(str, f)) for f in self.faces]
        head = ["ply", "format ascii 1.0", f"element vertex {len(self.points)}"] + [f"property double {a}" for a in "xyz"]
        head += [f"element face {len(self.faces)}", "property list uchar int vertex_indices", "end_header"]
        return "\n".join(head + rows) + "\n"


def near_hull(corners, hull, points):
    """As near_points, of a hull whose corners are at `points`; and which triangles come into it, how deep."""
    n, every = len(corners), np.arange(len(corners))
    index, weights, cores = [], [], []
    for p in points:
        index.append(every)
        weights.append(on_triangles(p, corners))
        cores.append(np.broadcast_to(p, (n, 3)))
    faces = points[hull.faces]
    for i in range(3):  # corners of the triangles and faces
        for k in range(n):
            w = on_triangles(corners[k, i], faces)
            index.append(np.full(len(faces), k))
            weights.append(np.tile(np.eye(3)[i], (len(faces), 1)))
            cores.append(np.einsum("nk,nkd->nd", w, faces))
    for a, b in hull.edges:
        for i, j in ((0, 1), (1, 2), (2, 0)):
            s, t = between_segments(np.broadcast_to(points[a], (n, 3)), np.broadcast_to(points[b], (n, 3)), corners[:, i],
                                    corners[:, j])
            there = ~np.isnan(s)
            w = np.zeros((there.sum(), 3))
            w[:, i], w[:, j] = 1 - t[there], t[there]
            index.append(every[there])
            weights.append(w)
            cores.append(points[a] + s[there, None] * (points[b] - points[a]))
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    deep = np.zeros(n)
    for k in range(n):  # what is left of it behind each face
        left = list(corners[k])
        for normal, face in zip(normals, faces):
            height = [normal @ (p - face[0]) for p in left]
            left = [q for m in range(len(left)) for q in
                    ([left[m]] if height[m] < 0 else [])
                    + ([left[m] + height[m] / (height[m] - height[m - len(left) + 1]) * (left[m - len(left) + 1] - left[m])]
                       if (height[m] < 0) != (height[m - len(left) + 1] < 0) else [])]
            if not left:
                break
        if left:
            deep[k] = max(min(normal @ (face[0] - p) for normal, face in zip(normals, faces)) for p in left)
    return np.concatenate(index), np.concatenate(weights), np.concatenate(cores), deep


# --- Forces: the nearest sum of pushes within cones -------------------------------------------------------------------


def non_negative(a, f, start):
    """x >= 0 with the least |a x - f| (Lawson, Hanson, Solving least squares problems, 1974, 23.3), from a guess."""
    x, used = start.copy(), start > 0
    for _ in range(3 * a.shape[1] + 10):
        while used.any():
            trial = np.zeros(len(x))
            trial[used] = np.linalg.lstsq(a[:, used], f, rcond=1e-13)[0]
            if trial[used].min() > 0:
                x = trial
                break
            falling = used & (trial <= 0)
            with np.errstate(divide="ignore", invalid="ignore"):
                part = np.min((x / (x - trial))[falling])
            x += max(0.0, min(1.0, part)) * (trial - x)
            used &= x > 1e-15 * max(1e-300, x.max())
            used &= ~(falling & (x <= 1e-14 * max(1e-300, x.max())))
            x[~used] = 0
        if not used.any():
            x[:] = 0
        gain = a.T @ (f - a @ x)
        gain[used] = 0
        if gain.max(initial=0) <= 1e-12 * np.linalg.norm(f):
            break
        used[np.argmax(gain)] = True
    return x


def beyond_least_pushes(a, f, normals, friction):
    """As beyond_cones, at most, by the least pushes without a thought of cones, brought into them. Where pushes are
    few there is no choice, and they are what was told; the search below comes near to them but slowly."""
    pushes = np.linalg.lstsq(a, f, rcond=1e-13)[0].reshape(-1, 3)
    for push, normal in zip(pushes, normals):
        along = max(0.0, push @ normal)
        side = push - (push @ normal) * normal
        length = np.linalg.norm(side)
        push[:] = along * normal + (min(1.0, friction * along / length) * side if length > 0 else 0)
    return np.linalg.norm(f - a @ pushes.ravel())


def beyond_cones(nodes, force, supports, weights, normals, friction):
    """The least |force - sum of pushes|, over |force|: each push is within the cone about its normal, at a point with
    these weights of its supporting nodes. Directions within the cones join where they serve most."""
    rows = {node: k for k, node in enumerate(nodes)}
    f = np.zeros((len(nodes), 3))
    for node, v in force.items():
        f[rows[node]] = v
    size = np.linalg.norm(f)
    f = f.ravel() / size

    def column(c, direction):
        one = np.zeros((len(nodes), 3))
        for node, w in zip(supports[c], weights[c]):
            if w > 0:
                one[rows[node]] += w * direction
        one = one.ravel()
        return one / np.linalg.norm(one)

    pushes = np.zeros((3 * len(nodes), 3 * len(supports)))
    for c, (support, weight) in enumerate(zip(supports, weights)):
        for node, w in zip(support, weight):
            pushes[3 * rows[node] : 3 * rows[node] + 3, 3 * c : 3 * c + 3] += w * np.eye(3)
    least = beyond_least_pushes(pushes, f, normals, friction)
    if least < 1e-8:
        return least

    columns, x, left = np.zeros((3 * len(nodes), 0)), np.zeros(0), f
    last = np.inf
    for _ in range(60):
        around = left.reshape(-1, 3)
        best = []
        for c in range(len(supports)):
            g = sum(w * around[rows[node]] for node, w in zip(supports[c], weights[c]))
            side = g - (g @ normals[c]) * normals[c]
            length = np.linalg.norm(side)
            direction = normals[c] + (friction / length * side if length > 0 else 0)
            one = column(c, direction)
            gain = one @ left
            if gain > 1e-9:
                best.append((gain, one))
        if not best:
            break
        best.sort(key=lambda pair: -pair[0])
        columns = np.column_stack([columns] + [one for _, one in best[:40]])
        x = non_negative(columns, f, np.concatenate([x, np.zeros(min(40, len(best)))]))
        columns, x = columns[:, x > 0], x[x > 0]
        left = f - columns @ x
        now = np.linalg.norm(left)
        if now < (1e-5 if friction else 1e-8) or (now > 0.98 * last and len(best) < 2):
            break
        last = now
    return min(least, np.linalg.norm(left))


# --- Models and answers -----------------------------------------------------------------------------------------------


class Model:
    def __init__(self, path):
        rows, self.fixed, self.triangles = [], [], []
        lines = iter(path.read_text().splitlines())
        for line in lines:
            words = line.split()
            if words and words[0] == "nodes":
                for _ in range(int(words[1])):
                    words = next(lines).split()
                    rows.append([float(w) for w in words[:3]])
                    self.fixed.append(words[5] != "-")
            elif words and words[0] == "triangles":
                self.triangles = np.array([[int(w) for w in next(lines).split()] for _ in range(int(words[1]))])
        self.rest, self.fixed = np.array(rows), np.array(self.fixed)
        corners = self.rest[self.triangles]
        self.edge = np.mean(np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2))
        self.surface = np.zeros(len(self.rest), dtype=bool)
        self.surface[self.triangles] = True
        self.free = ~self.fixed[self.triangles].any(axis=1)


def answers(text):
    """Steps: forces {node: vector}, shape, instrument (place, force, torque)."""
    steps, lines = [], iter(text.splitlines())
    for line in lines:
        words = line.split()
        if words[0] == "step":
            step = {"forces": {}, "time": float(words[2])}
        elif words[0] == "forces":
            for _ in range(int(words[2])):
                row = next(lines).split()
                step["forces"][int(row[0])] = np.array([float(w) for w in row[1:]])
        elif words[0] == "shapes":
            step["shape"] = np.array([next(lines).split() for _ in range(int(words[2]))], dtype=float)
        elif words[0] == "instruments":
            for _ in range(int(words[1])):
                row = np.array(next(lines).split()[1:], dtype=float)
                step["place"], step["force"], step["torque"] = row[:3], row[3:6], row[6:9]
        elif words[0] == "done":
            steps.append(step)
        else:
            raise ValueError(f"an answer that isn't known: {line}")
    return steps


def turned(axis, degrees, v):
    if degrees == 0:
        return v
    k, angle = axis / np.linalg.norm(axis), np.radians(degrees)
    return v * np.cos(angle) + np.cross(k, v) * np.sin(angle) + k * (k @ v) * (1 - np.cos(angle))


# --- Cases ------------------------------------------------------------------------------------------------------------


def numbers(*values):
    return " ".join(repr(float(v)) for part in values for v in np.ravel(part))


class Case:
    """An instrument on its way: lines of a scene, and where it is at each of its steps."""

    def __init__(self, body, random, mesh):
        self.mesh = mesh
        while not self.drawn(body, random):
            pass

    def drawn(self, body, random):
        """Whether it is away from what is held."""
        m = body.model
        corners = m.rest[m.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(normals, axis=1)
        at = random.choice(len(areas), p=np.where(m.free, areas, 0) / areas[m.free].sum())
        out = normals[at] / areas[at]
        self.radius = m.edge * np.exp(random.uniform(np.log(0.5), np.log(3)))
        self.friction = 0 if random.random() < 0.4 else random.uniform(0.05, 0.8)
        self.axis, self.hull = np.zeros(3), None
        if self.mesh:
            self.draw_hull(random)
        elif random.random() < 0.5:
            way = random.normal(size=3)
            way -= random.uniform(0.3, 1) * (way @ out) * out
            self.axis = random.uniform(1, 6) * self.radius * way / np.linalg.norm(way)
        point = random.dirichlet([1, 1, 1]) @ corners[at]
        self.core = np.stack([np.zeros(3), self.axis]) if not self.hull else self.hull.points
        lowest = -(self.core @ out).min() if self.hull else 0
        depth = random.uniform(0.05, 0.6) * min(self.radius + (lowest if self.hull else 0), 3 * m.edge)
        aside = np.cross(out, random.normal(size=3))
        aside *= random.uniform(0, 2) * m.edge / np.linalg.norm(aside)
        self.turn = (random.normal(size=3), random.uniform(0, 20) if self.core.any() and random.random() < 0.5 else 0.0)
        start = point - self.axis / 2 + out * (self.radius + lowest)
        while self.clearance(m, m.rest, start, self.core) < 0:
            start = start + 0.2 * (self.radius + lowest) * out
        pressed = point - self.axis / 2 + out * (self.radius + lowest - depth)
        held = m.rest[m.fixed & m.surface]
        reach = np.linalg.norm(self.core, axis=1).max() if self.hull else 0
        for place in (start, pressed, pressed + aside):
            foot = on_segment(held, place, place + self.axis)
            far = np.linalg.norm(place + foot[:, None] * self.axis - held, axis=1)
            if far.min(initial=np.inf) < self.radius + reach + 2 * m.edge:
                return False
        shape = "capsule" if self.axis.any() else "sphere"
        ends = numbers(start, start + self.axis) if self.axis.any() else numbers(start)
        what = f"mesh {{mesh}} radius={numbers(self.radius)}" if self.hull else f"{shape} {numbers(self.radius)}"
        self.lines = [f"object organ {body.path} {body.words}".rstrip(), "emit forces", "emit shapes", "emit instruments",
                      f"instrument probe {what} {ends}"
                      + (f" friction {numbers(self.friction)}" if self.friction else "")]
        self.cores, self.strict = [], []
        for k in range(1, body.steps + 1):
            x = k / body.steps
            down, along = min(1.0, 2 * x), max(0.0, 2 * x - 1)
            place = start + down * (pressed - start) + along * aside
            angle = along * self.turn[1]
            turn = f" turn {numbers(self.turn[0], angle)}" if self.turn[1] else ""
            self.lines += [f"move probe {numbers(place)}{turn}" + (f" over {body.step}" if body.over else ""),
                           f"step {body.step}"]
            self.cores.append(np.array([turned(self.turn[0], angle, p) for p in self.core]))
            self.strict.append(not body.moment)
            if body.moment:  # one step of integration, whose forces are those of where it ends
                self.lines.append(f"step {body.moment}")
                self.cores.append(self.cores[-1])
                self.strict.append(True)
        return True

    def draw_hull(self, random):
        """A jaw, tapered and a little crooked, or the hull of some points; rounded by a part of its size."""
        size = 2 * self.radius
        if random.random() < 0.5:
            box = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
            box *= np.where(box[:, :1] > 0, random.uniform(0.5, 0.9), 1)
            points = box * size * np.array([random.uniform(1, 2.5), random.uniform(0.4, 1), random.uniform(0.2, 0.5)])
            points += 0.01 * size * random.normal(size=points.shape)
        else:
            points = random.normal(size=(random.integers(5, 13), 3))
            points *= size / np.linalg.norm(points, axis=1)[:, None] * random.uniform(0.3, 1, size=3)
        turn, angle = random.normal(size=3), random.uniform(0, 180)
        self.hull = Hull(np.array([turned(turn, angle, p) for p in points]))
        self.radius = size * np.exp(random.uniform(np.log(0.03), np.log(0.3)))

    def clearance(self, m, shape, place, core):
        """Of triangles that can give way, and their pairs of nearest points with the distances."""
        near = self.near(m, shape, place, core)
        return near[0] - self.radius if near else np.inf

    def near(self, m, shape, place, core):
        corners, points = shape[m.triangles], place + core
        reach = 1.05 * self.radius
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        close = np.flatnonzero(((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low)).all(axis=1))
        if not len(close):
            return None
        deep = np.zeros(len(close))
        if self.hull:
            index, weights, cores, deep = near_hull(corners[close], self.hull, points)
        else:
            index, weights, cores = near_points(corners[close], points[0], points[1])
        places = np.einsum("nk,nkd->nd", weights, corners[close][index])
        far = np.linalg.norm(places - cores, axis=1)
        # A triangle with a corner that is held in the instrument can't leave it.
        held = m.fixed[m.triangles[close]].any(axis=1)
        least = far[~held[index]].min(initial=np.inf)
        if (deep[~held] > 0).any():
            least = -deep[~held].max()
        return least, far, close[index], weights, places, cores


def judge(case, m, step, core):
    """What a step breaks."""
    found = {"depth": 0.0, "cone": 0.0, "apart": 0.0, "sum": 0.0, "nodes": len(step["forces"])}
    near = case.near(m, step["shape"], step["place"], core)
    if near:
        found["depth"] = 1 - near[0] / case.radius
    forces = {node: f for node, f in step["forces"].items() if f.any()}
    if not forces:
        return found
    size = sum(np.linalg.norm(f) for f in forces.values())
    total = sum(forces.values())
    found["sum"] = np.linalg.norm(total + step["force"]) / size
    touched, points = set(), {}
    if near:
        _, far, triangles, weights, places, cores = near
        touched.update(m.triangles[triangles[far <= (1 + TOUCH) * case.radius]].ravel())
        for k in np.flatnonzero((far <= (1 + TOUCH) * case.radius) & (far > 0)):
            nodes = m.triangles[triangles[k]]
            normal = (places[k] - cores[k]) / far[k]
            support = tuple(sorted((int(n), round(float(w), 7)) for n, w in zip(nodes, weights[k]) if w > 1e-12))
            points.setdefault((support, tuple(np.round(normal, 7))), (nodes, weights[k], normal))
    found["apart"] = sum(np.linalg.norm(f) for node, f in forces.items() if node not in touched) / size
    moving = {node: f for node, f in forces.items() if node in touched}
    if moving and points:
        supports = [p[0] for p in points.values()]
        # Held nodes give no force: what acts on them is left out.
        weights = [np.where(m.fixed[s], 0, p[1]) for s, p in zip(supports, points.values())]
        kept = [k for k, w in enumerate(weights) if w.max() > 0]
        supports, weights = [supports[k] for k in kept], [weights[k] for k in kept]
        normals = [p[2] for k, p in enumerate(points.values()) if k in set(kept)]
        nodes = sorted(set(moving) | {int(n) for s in supports for n in s})
        found["cone"] = beyond_cones(nodes, moving, supports, weights, normals, case.friction)
    return found


# --- Bodies -----------------------------------------------------------------------------------------------------------


class Body:
    def __init__(self, name, share, make, words, **how):
        self.name, self.share, self.make, self.words = name, share, make, words
        self.steps, self.step = how.get("steps", 6), how.get("step", 0.02)
        self.over = how.get("over", False)  # whether moves take time
        self.moment = how.get("moment")  # s: a step so short that it is one of integration
        self.store = how.get("store", False)


def bodies(data):
    if data:
        liver, coarse = f"--unit cm {data}/sofa_liver_smooth.obj", f"--unit cm {data}/sofa_liver_coarse.obj"
        spleen, colon = f"--unit m {data}/hubmap_F_spleen_uv.obj", f"{data}/gca90_large_intestine_20k.stl"
    else:
        liver, coarse = "--primitive sphere:40x30 --size 30", "--primitive sphere:12x8 --size 30"
        spleen, colon = "--primitive sphere:60x40 --size 40", "--primitive tube:30x60 --size 15,200"
    low = "--fix z<{low}"
    moving = {"over": True, "moment": 1e-5}
    return [
        Body("liver, net", 0.2, f"{liver} {low}", "method=ffe", store=True),
        Body("spleen, net", 0.15, f"{spleen} --bend {low}", "method=ffe", store=True),
        Body("colon, net", 0.1, f"{colon} --bend {low}", "method=ffe", store=True),
        Body("liver, solid", 0.15, f"{liver} --solid --order 1 {low}", "method=ffe", store=True),
        Body("liver, quadratic solid", 0.1, f"{liver} --solid --cell 6 {low}", "method=ffe", store=True),
        Body("liver, net that moves", 0.12, f"{coarse} {low}", "method=ela", **moving),
        Body("spleen, net that moves", 0.08, f"{spleen} --bend {low}", "method=ela", **moving),
        Body("liver, net that moves implicitly", 0.06, f"{coarse} {low}", "method=ela integration=implicit", **moving),
        Body("liver, solid that moves", 0.04, f"{coarse} --solid --cell 12 --order 1 {low}", "method=ela", steps=4, **moving),
    ]


def prepare(body, folder, run):
    name = body.name.replace(",", "").replace(" ", "-")
    body.path = folder / f"{name}.ela"
    # Held below a fifth of its height, which is known from the model without.
    words = body.make.split()
    held = words.index("--fix")
    plain = words[:held] + words[held + 2 :]
    run(["exp2ela", "-q", "-o", str(body.path)] + plain)
    rest = Model(body.path).rest
    low = rest[:, 2].min() + 0.2 * (rest[:, 2].max() - rest[:, 2].min())
    words[held + 1] = words[held + 1].format(low=f"{low:.4f}")
    run(["exp2ela", "-q", "-o", str(body.path)] + words)
    body.model = Model(body.path)
    if body.store:
        run(["ffe-precompute", "-q", str(body.path), "-o", str(body.path.with_suffix(".h5"))])
        body.words = f"store={body.path.with_suffix('.h5')}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--data", type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path, help="models, and the scenes that break a bound")
    parser.add_argument("--meshes", action="store_true", help="convex meshes in place of spheres and capsules")
    parser.add_argument("--only", default="", help="bodies whose names hold this word")
    parser.add_argument("--case", type=int, help="this one alone of each body, and its steps")
    options = parser.parse_args()
    data = options.data if options.data and (options.data / "sofa_liver_smooth.obj").exists() else None

    def run(words):
        subprocess.run(words, check=True)

    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        broken = []
        print(f"{'':34}{'cases':>6}{'steps':>7}{'touched':>8}{'refused':>8}{'failed':>7}{'broken':>7}"
              f"{'depth':>10}{'cone':>10}{'apart':>10}{'sum':>10}")
        for number, body in enumerate(bodies(data)):
            if options.only not in body.name:
                continue
            prepare(body, folder, run)
            count = max(1, round(body.share * options.count))
            worst = dict.fromkeys(("depth", "cone", "apart", "sum"), 0.0)
            tally = dict.fromkeys(("steps", "touched", "refused", "failed", "broken"), 0)
            for k in range(count) if options.case is None else [options.case]:
                random = np.random.default_rng([options.seed, number, k] + [1] * options.meshes)
                case = Case(body, random, options.meshes)
                scene = folder / f"{body.path.stem}-{k}.scene"
                mesh = scene.with_suffix(".ply")
                if case.hull:
                    mesh.write_text(case.hull.text())
                scene.write_text("\n".join(case.lines).format(mesh=mesh.name) + "\n")
                try:
                    ran = subprocess.run(["ffe-run", "-j", "1", str(scene)], capture_output=True, text=True, timeout=LONG)
                except subprocess.TimeoutExpired:
                    tally["failed"] += 1
                    broken.append((scene, "failed", [f"not done in {LONG} s"]))
                    continue
                steps = answers(ran.stdout)
                wrong = []
                # A shape beyond the linear range is warned of; a step that fails there, and is told, is no mistake.
                refused = ran.returncode == 1 and "not to be trusted" in ran.stderr
                if refused:
                    tally["refused"] += 1
                elif ran.returncode != 0:
                    tally["failed"] += 1
                    wrong.append((ran.stderr.splitlines() or [f"status {ran.returncode}"])[-1])
                for s, step in enumerate(steps):
                    found = judge(case, body.model, step, case.cores[s])
                    tally["steps"] += 1
                    tally["touched"] += found["nodes"] > 0
                    if options.case is not None:
                        print(s, found, ran.stderr)
                    bounds = {"depth": TOUCH, "sum": 1e-9}
                    if case.strict[s]:
                        bounds |= {"cone": LAG, "apart": 1e-6}
                    for what, bound in bounds.items():
                        worst[what] = max(worst[what], found[what])
                        if not found[what] <= bound:
                            wrong.append(f"step {s + 1}: {what} {found[what]:.2g}")
                failed = ran.returncode != 0 and not refused
                if wrong and not failed:
                    tally["broken"] += 1
                if wrong:
                    broken.append((scene, "failed" if failed else "broken", wrong))
                else:
                    scene.unlink()
                    mesh.unlink(missing_ok=True)
            widths = {"steps": 7, "touched": 8, "refused": 8, "failed": 7, "broken": 7}
            print(f"{body.name:34}{count:6}" + "".join(f"{tally[t]:{w}}" for t, w in widths.items())
                  + "".join(f"{worst[w]:10.2g}" for w in worst), flush=True)
        for scene, kind, wrong in broken:
            print(f"{kind}: {scene}: {'; '.join(wrong[:4])}")
        return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Contact judged by textbook scenes: closed forms against answers of `ffe-run`.

Each scene is run with three meshes (aligned, turned by 17 degrees, coarse), elements of order 1 and 2, and three time
steps, and checked against its theory. In every scene contact forces must sum to zero, never pull, and surfaces must not
intersect. A table and plots are written to the page; the last line is `N passed, N failed, N skipped`, the status 1 on
failures. Without numpy and ipctk a slower test of intersections is used.
"""

import argparse
import concurrent.futures
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "report"))

import plot
from scene_runs import (GRAVITY, Failure, Scene, add, ball, box, cross, distance_to_segment, dot, grid, intersect, mapped, norm, obj,
                           plate, scale, sheet, sub, total, tube, turned, words_of)

EPS_V = 0.1  # mm/s: sliding speed below which smoothed friction creeps
ROUNDING = 1e-12  # sum of the forces of a closed system over the sum of their lengths
TURN = 17.0  # degrees
MESHES, ORDERS, DTS = ("aligned", "turned", "coarse"), (1, 2), (1 / 60, 1 / 200, 1 / 600)


class Check:
    """A measured value beside theory. `bound` is the largest |measured - theory|, or of `at_most` and `at_least` the limit."""

    def __init__(self, what, measured, theory, bound, unit="", kind="near"):
        self.what, self.measured, self.theory, self.bound, self.unit, self.kind = what, measured, theory, bound, unit, kind
        if kind == "near":
            self.passed = abs(measured - theory) <= bound
        elif kind == "at most":
            self.passed = measured <= bound
        elif kind == "at least":
            self.passed = measured >= bound
        else:
            self.passed = True


def near(what, measured, theory, bound, unit=""):
    return Check(what, measured, theory, bound, unit)


def at_most(what, measured, bound, unit="", theory=0.0):
    return Check(what, measured, theory, bound, unit, "at most")


def at_least(what, measured, bound, unit="", theory=0.0):
    return Check(what, measured, theory, bound, unit, "at least")


def shown(what, measured, unit=""):
    return Check(what, measured, float("nan"), float("nan"), unit, "shown")


# --- What all scenes share ----------------------------------------------------------------------------------------------


class Case:
    """A scene with its parameters: `build` writes it, `judge` yields checks from the frames of its answers."""

    name, source = "", ""
    friction = 0.0
    checked_frames = 40  # at which surfaces are searched for intersections
    limit = 60.0  # s

    def __init__(self, mesh="aligned", order=1, dt=1 / 200, quick=False, **parameters):
        self.mesh, self.order, self.dt, self.quick = mesh, order, dt, quick
        self.parameters = parameters
        self.closed = True  # no supports among the forces: they sum to zero
        self.supports = {}  # of objects: nodes that are displaced, whose forces are left out
        self.faces = []  # (object, nodes, normal into the object): no pull through this face
        self.couples = []  # (a, b): bodies that must not pull each other along the line of their centres
        self.tools = []  # (name, radius, axis) of spheres and capsules
        for key, value in parameters.items():
            setattr(self, key, value)

    def __str__(self):
        own = " ".join(f"{k}={v:g}" if isinstance(v, float) else f"{k}={v}" for k, v in self.parameters.items())
        return " ".join(w for w in (self.name, own, self.mesh, f"order={self.order}", f"dt=1/{round(1 / self.dt)}") if w)

    def build(self, s):
        raise NotImplementedError

    def judge(self, s, frames):
        raise NotImplementedError

    def execute(self, s, limit):
        """Runs the scene; its checks."""
        frames = s.run(limit)
        return list(self.judge(s, frames)) + list(self.always(s, frames))

    def force(self, frame, name, nodes=None):
        """Contact force on an object, or on some of its nodes."""
        forces = frame.forces.get(name, {})
        out = self.supports.get(name, ())
        if nodes is None:
            return total(f for n, f in forces.items() if n not in out)
        return total(forces[n] for n in nodes if n in forces and n not in out)

    def always(self, s, frames):
        """Sum of forces, pull and intersections, of all frames."""
        worst, pull, node_pull = 0.0, 0.0, 0.0
        largest = max((norm(f) for frame in frames for name, of in frame.forces.items() for n, f in of.items()
                       if n not in self.supports.get(name, ())), default=0.0)
        for frame in frames:
            every = [f for name, of in frame.forces.items() for n, f in of.items() if n not in self.supports.get(name, ())]
            every += [f for _, f, _ in frame.instruments.values()]
            size = math.fsum(map(norm, every))
            if self.closed and size > 0:
                worst = max(worst, norm(total(every)) / size)
            for name, nodes, normal in self.faces:
                of = frame.forces.get(name, {})
                along = [dot(of[n], normal) for n in nodes if n in of]
                pushed = math.fsum(a for a in along if a > 0)
                if along and largest > 0:
                    pull = max(pull, -math.fsum(along) / largest)
                    node_pull = max(node_pull, -min(along) / max(pushed, 1e-3 * largest))
            for a, b in self.couples:
                if a in frame.shapes and b in frame.shapes and largest > 0:
                    way = sub(s.models[a].centre(frame.shapes[a]), s.models[b].centre(frame.shapes[b]))
                    pull = max(pull, -dot(self.force(frame, a), way) / norm(way) / largest)
        if self.closed:
            yield at_most("sum of forces over their lengths", worst, ROUNDING)
        if self.faces or self.couples:
            yield at_most("pull of a body over the largest nodal force", pull, 1e-9)
        if self.faces:
            yield at_most("pull at a node over the push on its face", node_pull, 1e-3)
        yield from self.apart(s, frames)

    def apart(self, s, frames):
        shaped = [f for f in frames if f.shapes]
        every = max(1, len(shaped) // self.checked_frames)
        changed, met, near_tool = {}, [], math.inf
        for k, frame in enumerate(shaped):
            changed.update(frame.triangles)
            if k % every and k != len(shaped) - 1:
                continue
            if s.pairs and intersect(s.models, frame, changed, s.pairs):
                met.append(frame.time)
            for name, radius, axis in self.tools:
                if name in frame.instruments:
                    p = frame.instruments[name][0]
                    q = add(p, axis)
                    for object_name, shape in frame.shapes.items():
                        t = changed.get(object_name) or s.models[object_name].triangles
                        near_tool = min(near_tool, distance_to_segment(p, q, shape, t) / radius)
        if s.pairs:
            yield at_most("answers with surfaces that intersect", len(met), 0)
        if near_tool < math.inf:
            yield at_least("least distance from the tool's axis over its radius", near_tool, 0.999, theory=1.0)


def second_difference(frames, s, name, k):
    """Acceleration of the centre of mass over the last 2 k steps: exact for backward Euler steps of constant acceleration."""
    a, b, c = (s.models[name].centre(frames[n].shapes[name]) for n in (-1 - 2 * k, -1 - k, -1))
    h = frames[-1].time - frames[-1 - k].time
    return scale(1 / h**2, add(sub(c, b), sub(a, b)))


def mean(values):
    values = list(values)
    return math.fsum(values) / len(values)


def kinetic(model, before, after, dt):
    return 0.5 * math.fsum(m * norm(sub(b, a)) ** 2 for m, a, b in zip(model.mass, before, after)) / dt**2


def momentum(model, before, after, dt):
    return total(scale(m / dt, sub(b, a)) for m, a, b in zip(model.mass, before, after))


def angular(model, before, after, dt):
    return total(scale(m / dt, cross(b, sub(b, a))) for m, a, b in zip(model.mass, before, after))


def turn_of(mesh):
    return TURN if mesh == "turned" else 0.0


# Blocks of 20 x 20 x 10 mm by mesh; the slab under them.
BLOCKS = {"aligned": (2, 2, 1), "turned": (5, 5, 2), "coarse": (2, 2, 1)}


def slab(s, mesh, length=120.0, width=40.0, name="slab", young=1e5, thick=5.0):
    cells = (round(length / 40), 2) if mesh == "coarse" else (round(length / 10), round(width / 10))
    return s.solid(name, box((*cells, 1), (length, width, thick), (0, 0, -thick)), young, fix=f"z<{-0.999 * thick!r}")


def block(s, mesh, name, corner, size=(20, 20, 10), young=2e4, words="", cells=None, turn=None):
    turn = turn_of(mesh) if turn is None else turn
    return s.solid(name, box(cells or BLOCKS[mesh], size, corner, turn), young, words=words)


class Slope(Case):
    """A block on a plane that is tilted after 0.1 s of rest.

    Coulomb: at tan(angle) < mu it sticks, tangential over normal force being tan(angle), and smoothed friction lets it creep
    slower than eps_v; else it slides with g (sin(angle) - mu cos(angle)), tangential over normal force being mu. The normal
    force is m g cos(angle) in the mean. Acceleration is judged relative to what drives the block, g sin(angle), since near
    the angle of friction the difference of two large terms is left.
    """

    name, source = "slope", "Coulomb 1785; Li et al. 2020, eq. 14, for creep"
    angle, mu = 10.0, 0.0

    def theory(self):
        a = math.radians(self.angle)
        self.sticks = self.mu > 0 and math.tan(a) <= self.mu
        self.acceleration = 0.0 if self.sticks else GRAVITY * (math.sin(a) - self.mu * math.cos(a))
        self.ratio = min(self.mu, math.tan(a))
        # Of the smoothed friction 2 s - s^2 = tan(angle) / mu, s the creep over eps_v.
        self.creep = EPS_V * (1 - math.sqrt(1 - math.tan(a) / self.mu)) if self.sticks else 0.0

    def expected(self):
        way = 0.5 * self.acceleration * (self.slides * self.dt) ** 2 if self.acceleration else 0.0
        return (f"after {self.settled} steps of rest acceleration {self.acceleration:.6g} mm/s2 along x, {way:.4g} mm in the end; tangential over normal "
                f"force {self.ratio:.5g}; normal force m g cos = {self.weight * math.cos(math.radians(self.angle)):.6g}e-6 N; creep {self.creep:.4g} mm/s")

    def build(self, s):
        self.theory()
        slab(s, self.mesh)
        b = block(s, self.mesh, "block", (10, 10, 0.01))
        s.contact("slab", "block", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        s.steps(0.1)
        self.settled = round(0.1 / self.dt)
        s.gravity(self.angle)
        self.slides = s.steps(min(0.25, math.sqrt(2 * 60 / self.acceleration)) if self.acceleration > 0 else 0.25)
        low = b.where(lambda p: p[2] < 0.011)
        self.faces = [("block", low, (0, 0, 1))]
        self.weight = b.weight * GRAVITY

    def judge(self, s, frames):
        k = max(1, math.floor(0.3 * self.slides))
        window = frames[-2 * k:]
        n = mean(self.force(f, "block")[2] for f in window)
        t = mean(self.force(f, "block")[0] for f in window)
        weight = s.models["block"].weight * GRAVITY
        a = math.radians(self.angle)
        yield near("normal force over m g cos(angle)", n / (weight * math.cos(a)), 1, 0.005)
        ratio = -t / n if n > 0 else math.inf
        yield near("tangential over normal force", ratio, self.ratio, 0.01 * max(self.ratio, math.tan(a), 0.1))
        start, x0, x1 = (s.models["block"].centre(f.shapes["block"]) for f in (frames[self.settled - 1], window[0], window[-1]))
        if self.sticks:
            speed = (x1[0] - x0[0]) / (window[-1].time - window[0].time)
            yield near("creep", speed, self.creep, 2 * EPS_V, "mm/s")
        else:
            found = second_difference(frames, s, "block", k)[0]
            yield near("acceleration over g sin(angle)", found / (GRAVITY * math.sin(a)) if a else found / GRAVITY,
                       self.acceleration / (GRAVITY * math.sin(a)) if a else 0, 0.01)
        moved = sub(x1, start)
        yield at_most("sideways, mm", abs(moved[1]), max(0.02, 0.01 * abs(moved[0])), "mm")


class Rest(Case):
    """A block at rest on a level plane for ten seconds: it stays where it is, its weight is borne, and no energy comes."""

    name, source = "rest", "statics"

    def expected(self):
        return "no node drifts by more than 0.01 mm after 0.3 s; the block bears its weight of 39240e-6 N"

    mu, duration = 0.3, 10.0
    limit = 120.0

    def build(self, s):
        slab(s, self.mesh, length=40)
        b = block(s, self.mesh, "block", (10, 10, 0.01))
        s.contact("slab", "block", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        s.steps(0.3, 0.1)
        s.steps(self.duration, 0.1)
        self.faces = [("block", b.where(lambda p: p[2] < 0.011), (0, 0, 1))]

    def judge(self, s, frames):
        b, start = s.models["block"], frames[2].shapes["block"]
        drift = max(norm(sub(p, q)) for f in frames[3:] for p, q in zip(f.shapes["block"], start))
        yield at_most("largest drift of a node", drift, 0.01, "mm")
        weight = b.weight * GRAVITY
        yield near("normal force over weight, worst", max((self.force(f, "block")[2] / weight for f in frames[3:]), key=lambda r: abs(r - 1)), 1, 0.005)
        yield at_most("tangential over normal force", max(math.hypot(*self.force(f, "block")[:2]) / max(1e-9, self.force(f, "block")[2])
                                                         for f in frames[3:]), 0.003)
        heights = [b.centre(f.shapes["block"])[2] for f in frames[3:]]
        yield at_most("energy gained over weight x 1 mm", max(heights) - heights[0], 1e-3)


class Stack(Case):
    """Five blocks on each other: the face between two bears the weight above."""

    name, source = "stack", "statics"

    def expected(self):
        return "weights (39240e-6 N each) on the bottoms of the blocks: 5 4 3 2 1; on the slab -5"

    mu, count = 0.3, 5
    limit = 360.0  # turned, quadratic, 1/600 s: 480 steps of half a second

    def build(self, s):
        slab(s, self.mesh, length=40)
        for k in range(self.count):
            turn = TURN * (k % 2) if self.mesh == "turned" else 0.0
            b = block(s, self.mesh, f"b{k}", (10, 10, 0.01 * (k + 1) + 10 * k), turn=turn)
            s.contact(f"b{k - 1}" if k else "slab", f"b{k}", self.mu)
            z = 0.01 * (k + 1) + 10 * k
            self.faces.append((f"b{k}", b.where(lambda p: p[2] < z + 1e-6), (0, 0, 1)))
            self.faces.append((f"b{k}", b.where(lambda p: p[2] > z + 10 - 1e-6), (0, 0, -1)))
        s.gravity()
        s.emit("shapes", "forces")
        s.steps(0.8)

    def judge(self, s, frames):
        window = [f for f in frames if f.time > 0.7]
        for k in range(self.count):
            weight = s.models[f"b{k}"].weight * GRAVITY
            low = mean(self.force(f, f"b{k}", self.faces[2 * k][1])[2] for f in window) / weight
            yield near(f"force under block {k + 1}, weights", low, self.count - k, 0.005 * (self.count - k))
        yield near("force on the slab, weights", mean(self.force(f, "slab")[2] for f in window) / weight, -self.count, 0.005 * self.count)
        # Of means over 0.1 s, about the period of the tower's sway, which small steps hardly damp.
        before = [f for f in frames if 0.6 < f.time <= 0.7]
        middle = lambda of, name: scale(1 / len(of), total(s.models[name].centre(f.shapes[name]) for f in of))
        drift = max(norm(sub(middle(window, f"b{k}"), middle(before, f"b{k}"))) for k in range(self.count))
        yield at_most("drift in 0.1 s", drift, 2 * EPS_V * 0.1, "mm")


class Drop(Case):
    """A ball dropped by 30 mm on a slab, or a block with friction that falls flat by 2 mm.

    Energy of motion and weight never exceeds that of the start, since what is elastic is positive. In each backward Euler
    step m (v_n - v_(n-1)) = dt (F_n + m g) with v_n = (x_n - x_(n-1)) / dt, so that told forces are those that moved the ball.
    """

    name, source = "drop", "conservation of energy and momentum"

    def expected(self):
        return "m (v_n - v_(n-1)) = dt (F_n + m g) in each step; kinetic and potential energy never above that of the start"

    height, mu = 30.0, 0.0

    def build(self, s):
        cells = {"aligned": 4, "turned": 4, "coarse": 2}[self.mesh]
        n = 2 if self.mesh == "coarse" else 6
        s.solid("slab", box((n, n, 1), (60, 60, 10), (-30, -30, -10)), 1e5, fix="z<-9.99")
        if self.mu > 0:
            body = box((cells, cells, cells), (20, 20, 20), (-10, -10, self.height), degrees=turn_of(self.mesh))
        else:
            body = ball(cells, 10, (0.3, 0.2, 10 + self.height), degrees=turn_of(self.mesh))
        s.solid("ball", body, 2e4)
        s.contact("slab", "ball", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        s.steps(0.3)
        self.couples = [("ball", "slab")]

    def judge(self, s, frames):
        dt = self.dt
        energy, residual, largest, impulse, off = [], 0.0, 0.0, 0.0, (0.0, 0.0, 0.0)
        b = s.models["ball"]
        shapes = [{n: m.rest for n, m in s.models.items()}] + [f.shapes for f in frames]
        potential = lambda of: sum(m.weight * GRAVITY * m.centre(of[n])[2] for n, m in s.models.items())
        floor = potential({"ball": [sub(p, (0, 0, self.height)) for p in b.rest], "slab": s.models["slab"].rest})
        energy = [potential(shapes[0]) - floor]
        old = (0.0, 0.0, 0.0)
        for k, f in enumerate(frames):
            energy.append(potential(f.shapes) - floor + sum(kinetic(m, shapes[k][n], f.shapes[n], dt) for n, m in s.models.items()))
            new = momentum(b, shapes[k]["ball"], f.shapes["ball"], dt)
            force = self.force(f, "ball")
            change = sub(sub(new, old), (0, 0, -dt * b.weight * GRAVITY))
            off = add(off, sub(change, scale(dt, force)))
            residual, largest = max(residual, norm(off)), max(largest, norm(change))
            impulse += norm(change)
            old = new
        yield at_most("energy over that of the start, largest", max(energy) / energy[0], 1 + 1e-9, theory=1.0)
        # Where a step was taken in halves the speed at its end is not its way over its length: what is off is made up for by the
        # next one, and only the sum says something.
        if s.stats.get("contact_halvings"):
            residual = norm(off)
        yield at_most("momentum not of told forces, over the largest change", residual / max(largest, 1e-30), 0.005)
        yield at_least("impulse over m sqrt(2 g h)", impulse / (b.weight * math.sqrt(2 * GRAVITY * self.height)), 0.9, theory=1.0)
        lowest = min(range(len(frames)), key=lambda k: b.centre(frames[k].shapes["ball"])[2])
        top = max(b.centre(f.shapes["ball"])[2] for f in frames[lowest:]) - b.centre(frames[lowest].shapes["ball"])[2]
        yield at_most("rebound over the drop", top / self.height, 1)


class Balls(Case):
    """Two equal balls without gravity, one thrown at the other, their centres `offset` mm off the line.

    Forces of pairs are opposite, so momentum stays; they act along one line (friction at a common point within the gap), so
    that their moments cancel. A backward Euler step without outer forces changes sum m x_n x v_n by dt sum m v_n x v_(n-1),
    which is taken off. The throw is a force on each node by its mass, so that no strain is stored, and the energy of motion
    never exceeds that of the throw.
    """

    name, source = "balls", "conservation of momentum, angular momentum and energy"

    def expected(self):
        return f"thrown in {self.thrown} steps to {self.speed:g} mm/s, then momentum is constant; the struck ball gets about half the speed or more"

    offset, mu, speed = 0.0, 0.0, 300.0

    def build(self, s):
        cells = {"aligned": 4, "turned": 4, "coarse": 2}[self.mesh]
        a = s.solid("a", ball(cells, 10, (-13, 0, 0)), 2e4)
        s.solid("b", ball(cells, 10, (13, self.offset, 0), degrees=turn_of(self.mesh)), 2e4)
        s.contact("a", "b", self.mu)
        time = 0.0167
        push = self.speed / (self.dt * round(max(1, time / self.dt)))
        s.emit("shapes", "forces")
        s.lines += [f"force a {n} {m * push!r} 0 0" for n, m in enumerate(a.mass)]
        self.thrown = s.steps(time)
        s.line("release a all")
        s.steps(0.15)
        self.couples = [("a", "b")] if self.mu == 0 else []

    def judge(self, s, frames):
        dt, k0 = self.dt, self.thrown
        shapes = [f.shapes for f in frames]
        both = lambda of, k: [of(s.models[n], shapes[k - 1][n], shapes[k][n], dt) for n in ("a", "b")]
        p0, l0, e0 = total(both(momentum, k0)), total(both(angular, k0)), sum(both(kinetic, k0))
        worst_p, worst_l, worst_e, moment, taken = 0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0)
        for k in range(k0 + 1, len(frames)):
            worst_p = max(worst_p, norm(sub(total(both(momentum, k)), p0)) / norm(p0))
            for n in ("a", "b"):
                rows = zip(s.models[n].mass, shapes[k - 2][n], shapes[k - 1][n], shapes[k][n])
                taken = add(taken, total(scale(m / dt, cross(sub(z, y), sub(y, x))) for m, x, y, z in rows))
            worst_l = max(worst_l, norm(sub(sub(total(both(angular, k)), l0), taken)) / (norm(p0) * 10))
            worst_e = max(worst_e, sum(both(kinetic, k)) / e0)
            f = [(shapes[k][n][i], v) for n in ("a", "b") for i, v in frames[k].forces.get(n, {}).items()]
            size = math.fsum(norm(v) for _, v in f)
            if size > 0:
                moment = max(moment, norm(total(cross(x, v) for x, v in f)) / (size * 10))
        yield at_most("change of momentum", worst_p, 1e-6)
        yield at_most("change of angular momentum over m v R", worst_l, 0.002)
        # Shapes are those behind the last translation, which makes momentum exact, by up to 2/1000 of the smallest gap.
        yield at_most("moment of contact forces over R sum |F|", moment, 1e-3 if self.mu else 1e-6)
        yield at_most("energy of motion over that of the throw, largest", worst_e, 1 + 1e-6, theory=1.0)
        va = scale(1 / s.models["a"].weight, momentum(s.models["a"], shapes[-2]["a"], shapes[-1]["a"], dt))
        vb = scale(1 / s.models["b"].weight, momentum(s.models["b"], shapes[-2]["b"], shapes[-1]["b"], dt))
        yield at_least("speed of the struck ball over half that of the throw", vb[0] / (self.speed / 2), 0.5 if self.offset > 5 else 0.95, theory=1.0)
        yield at_most("speed of parting over that of the throw", norm(sub(vb, va)) / self.speed, 1 + 1e-6)


class Bar(Case):
    """A bar thrown against a wall along its axis, Poisson's ratio 0: a wave of pressure runs through it and back.

    In one dimension the wall feels rho c v A for the time 2 L / c, c = sqrt(E / rho), and the bar leaves with its old speed.
    Steps of second order are checked against that; the discrete bar rings behind the wave front, so that a little is left in it.
    """

    name, source = "bar", "Saint-Venant 1867: longitudinal impact of a bar; Timoshenko and Goodier, Theory of Elasticity, 168"
    length, section, young, speed = 60.0, 10.0, 2e5, 300.0

    def wave(self, bar):
        density = bar.weight / (self.length * self.section**2)  # g/mm3; 1 Pa = 1 g/(mm s2)
        c = math.sqrt(self.young / density)
        return density * c * self.speed * self.section**2, 2 * self.length / c

    def expected(self):
        return "the wall feels rho c v A for 2 L / c; the bar leaves with its speed"

    def build(self, s):
        cells = {"aligned": (24, 2, 2), "turned": (24, 2, 2), "coarse": (12, 1, 1)}[self.mesh]
        half = self.section / 2
        axle = lambda mesh: mapped(mesh, lambda p: turned(p, (1, 0, 0), turn_of(self.mesh)))
        s.lines[0] += " order=2"
        s.solid("wall", box((1, 2, 2), (5, 20, 20), (-5.02, -10, -10)), 1e7, poisson=0.0, fix="x<1")
        b = s.solid("bar", axle(box(cells, (self.length, self.section, self.section), (0.3, -half, -half))), self.young, poisson=0.0)
        s.contact("wall", "bar")
        s.emit("shapes", "forces")
        s.lines += [f"force bar {n} {-m * self.speed / self.dt!r} 0 0" for n, m in enumerate(b.mass)]
        s.line("step")
        s.line("release bar all")
        s.steps(0.02)
        self.couples = [("bar", "wall")]

    def judge(self, s, frames):
        bar = s.models["bar"]
        force, lasts = self.wave(bar)
        of = [self.force(f, "bar")[0] for f in frames]
        on = [k for k, f in enumerate(of) if f > 0.05 * force]
        plateau = of[on[0] + len(on) // 4: on[0] + max(1, 3 * len(on) // 4)]
        yield near("mean force on the wall over rho c v A", mean(plateau) / force, 1, 0.04 if self.mesh == "coarse" else 0.02)
        yield near("time in contact over 2 L / c", len(on) * self.dt / lasts, 1, 0.05 + 1.5 * self.dt / lasts)
        speed = (bar.centre(frames[-1].shapes["bar"])[0] - bar.centre(frames[-2].shapes["bar"])[0]) / self.dt
        yield near("speed of parting over that of the throw", speed / self.speed, 1, 0.15)
        yield near("impulse over m (v + v')", math.fsum(of) * self.dt / (bar.weight * (self.speed + speed)), 1, 0.01)


def part_of_obj(path, name):
    """One object of an OBJ file: (points, triangles)."""
    points, triangles, base, inside, seen = [], [], 0, False, 0
    for line in pathlib.Path(path).read_text().splitlines():
        w = line.split()
        if not w:
            continue
        if w[0] == "o":
            inside, base = w[1] == name, seen
        elif w[0] == "v":
            seen += 1
            if inside:
                points.append(tuple(map(float, w[1:4])))
        elif w[0] == "f" and inside:
            n = [int(x.split("/")[0]) for x in w[1:]]
            triangles += [(n[0] - 1 - base, n[k] - 1 - base, n[k + 1] - 1 - base) for k in range(1, len(n) - 1)]
    return points, triangles


class GallBladder(Case):
    """A gall bladder of quadratic tetrahedra, held at its neck, pinched by two capsules and pulled.

    The capsules' forces are opposite to that of the organ; surface stays outside of them; the processor time is told, and
    must be below three seconds for each second of the scene.
    """

    name, source = "gall bladder", "Newton's third law"

    def expected(self):
        return "capsules feel the opposite of the organ's forces; at most 3 s of processor time a second; surface outside of R = 2 mm"

    mu, cell = 0.6, 6.6
    limit = 90.0

    def build(self, s):
        path = Case.data / "ts_liver_gallbladder_portal.obj"
        if not path.exists():
            raise Skipped(f"no {path.name}")
        points, triangles = part_of_obj(path, "gallbladder")
        low = [min(p[a] for p in points) for a in range(3)]
        high = [max(p[a] for p in points) for a in range(3)]
        middle = [(l + h) / 2 for l, h in zip(low, high)]
        points = [tuple(p[a] - middle[a] for a in range(3)) for p in points]
        (s.folder / "organ.obj").write_text(obj((points, triangles)))
        top = high[2] - middle[2]
        s.program("exp2ela", "-q", "organ.obj", "--unit", "mm", "--solid", "--cell", self.cell, "--no-skin", "--material", "gallbladder", "--order",
                  self.order, "--fix", f"z>{0.6 * top!r}", "--name", "bladder", "-o", "bladder.ela")
        m = s.object("bladder")
        # Pinched across its thinner side, half way down.
        at = -0.35 * top
        ring = [p for p in m.rest if abs(p[2] - at) < self.cell]
        cx = (min(p[0] for p in ring) + max(p[0] for p in ring)) / 2
        cy, half = (min(p[1] for p in ring) + max(p[1] for p in ring)) / 2, (max(p[1] for p in ring) - min(p[1] for p in ring)) / 2
        axis = (12.0, 0, 0)
        away, close = half + 2.6, 0.75 * half + 2
        for name, side in (("left", -1), ("right", 1)):
            start = (cx - 6, cy + side * away, at)
            s.line(f"instrument {name} capsule 2 {words_of(start, add(start, axis))} friction {self.mu!r}")
            self.tools.append((name, 2.0, axis))
        s.emit("shapes", "forces", "instruments")
        for name, side in (("left", -1), ("right", 1)):
            s.line(f"move {name} {words_of((cx - 6, cy + side * close, at))} over 0.3")
        s.steps(0.3, 0.05)
        for name, side in (("left", -1), ("right", 1)):
            s.line(f"move {name} {words_of((cx - 6, cy + side * close, at - 8))} over 0.5")
        s.steps(0.5, 0.05)

    def judge(self, s, frames):
        self.checked_frames = 8
        left, right = (mean(f.instruments[n][1][1] for f in frames[4:6]) for n in ("left", "right"))
        yield at_least("pinch borne by both capsules, 1e-6 N", min(-left, right), 1.0)
        yield at_most("processor time a second of the scene", s.cpu / frames[-1].time, 3.0, "s")


class NetUnderBall(Case):
    """A solid ball falls on a net that is held along its border, and comes to rest: the net bears its weight.

    Both are slowed by drag, whose force is gone at rest.
    """

    name, source = "net under a ball", "statics"
    mu = 0.3
    limit = 90.0

    def expected(self):
        return "in the end the net bears the weight of the ball; at most 2 s of processor time a second"

    def build(self, s):
        n = {"aligned": 20, "turned": 20, "coarse": 10}[self.mesh]
        spin = lambda p: turned(p, (0, 0, 1), turn_of(self.mesh))
        s.net("net", sheet(n, n, lambda i, j: spin((-30 + 60 * i / n, -30 + 60 * j / n, 0))), young=2e5, drag=10, fix="boundary")
        s.solid("ball", ball(4 if self.mesh != "coarse" else 3, 8, (0, 0, 8.5)), 2e4, drag=10)
        s.contact("net", "ball", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        s.steps(1.5, 0.05)
        self.last = s.steps(0.1)
        self.couples = [("ball", "net")]

    def judge(self, s, frames):
        weight = s.models["ball"].weight * GRAVITY
        yield near("force on the ball over its weight", mean(self.force(f, "ball")[2] for f in frames[-self.last:]) / weight, 1, 0.01)
        yield at_most("processor time a second of the scene", s.cpu / frames[-1].time, 2.0, "s")


class Topple(Case):
    """A block of 10 x 10 x 20 mm on a plane that is tilted slowly: it tips where tan(angle) = width / height = 1/2.

    `beyond` degrees past that angle (26.57 degrees) it falls, before it stands. The plane tilts in a second and then stays for
    half a second, in which a rigid block one degree beyond turns by 50 degrees.
    """

    name, source = "topple", "statics: the line of the weight leaves the base"
    beyond = 1.0
    mu = 1.0

    def build(self, s):
        self.cells = {"aligned": (2, 2, 4), "turned": (3, 3, 6), "coarse": (1, 1, 2)}[self.mesh]
        turn = turn_of(self.mesh)
        towards = (math.cos(math.radians(turn)), math.sin(math.radians(turn)))
        n = (2, 1) if self.mesh == "coarse" else (12, 8)
        s.solid("slab", box((*n, 1), (60, 40, 5), (0, 0, -5)), 1e6, fix="z<-4.99")
        b = block(s, self.mesh, "block", (10, 15, 0.01), (10, 10, 20), 1e6, cells=self.cells)
        s.contact("slab", "block", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        s.steps(0.1, 0.05)
        last = math.degrees(math.atan(0.5)) + self.beyond
        for k in range(60):
            s.gravity(last * (k + 1) / 60, towards)
            s.steps(1 / 60, 1 / 60)
        s.steps(0.5, 0.05)
        self.low, self.high = b.where(lambda p: p[2] < 0.0101), b.where(lambda p: p[2] > 20.0099)

    def lean(self, shape):
        middle = lambda nodes: scale(1 / len(nodes), total(shape[n] for n in nodes))
        d = sub(middle(self.high), middle(self.low))
        return math.degrees(math.acos(max(-1, min(1, d[2] / norm(d)))))

    def judge(self, s, frames):
        largest = max(self.lean(f.shapes["block"]) for f in frames)
        if self.beyond > 0:
            yield at_least("lean of the block that falls, degrees", largest, 10)
        else:
            yield at_most("lean of the block that stands, degrees", largest, 0.5)
        stands = [f for f in frames if self.lean(f.shapes["block"]) < 1]
        weight = s.models["block"].weight * GRAVITY
        yield near("normal force over m g, before", self.force(stands[1], "block")[2] / weight, 1, 0.005)


class Pendulum(Case):
    """A bar on a hinge, under a gravity tilted by 40 degrees, swings against a wall and comes to rest.

    At rest the moments of the contact force and of the weight about the hinge cancel, whatever the shape. Energy of motion
    and weight never exceeds that of the start.
    """

    name, source = "pendulum", "moments about the hinge; conservation of energy"
    mu = 0.0

    def build(self, s):
        n = {"aligned": (2, 2, 12), "turned": (2, 3, 13), "coarse": (2, 1, 6)}[self.mesh]
        s.solid("bar", box(n, (6, 6, 60), (-3, -3, -60)), 2e5, fix="x>-0.001 and x<0.001 and z>-0.001")
        wall = box({"aligned": (1, 4, 4), "turned": (1, 4, 4), "coarse": (1, 1, 1)}[self.mesh], (5, 40, 40), (8, -20, -75))
        if self.mesh == "turned":
            wall = mapped(wall, lambda p: add((0, 0, -55), turned(sub(p, (0, 0, -55)), (1, 0, 0), TURN)))
        s.solid("wall", wall, 2e5, fix="x>12.99")
        s.contact("wall", "bar", self.mu)
        s.gravity(40)
        s.emit("shapes", "forces")
        self.count = s.steps(1.0)
        self.faces = [("wall", s.models["wall"].where(lambda p: p[0] < 8.001), (1, 0, 0))]

    def judge(self, s, frames):
        bar, a = s.models["bar"], math.radians(40)
        g = (GRAVITY * math.sin(a), 0, -GRAVITY * math.cos(a))
        shapes = [bar.rest] + [f.shapes["bar"] for f in frames]
        energy = [-bar.weight * dot(g, bar.centre(x)) + (kinetic(bar, shapes[k - 1], x, self.dt) if k else 0) for k, x in enumerate(shapes)]
        fall = bar.weight * GRAVITY * 5
        yield at_most("energy gained over m g 5 mm", (max(energy) - energy[0]) / fall, 1e-9)
        window = frames[-max(4, self.count // 20):]
        contact = mean(total(cross(f.shapes["bar"][n], v) for n, v in f.forces.get("bar", {}).items())[1] for f in window)
        weight = mean(total(cross(x, scale(m, g)) for x, m in zip(f.shapes["bar"], bar.mass))[1] for f in window)
        yield near("moment of the contact force over that of the weight", contact / weight, -1, 0.005)
        # It still rings: small steps hardly damp the bar itself.
        yield at_most("largest speed of the centre at rest", max(norm(sub(bar.centre(q.shapes["bar"]), bar.centre(p.shapes["bar"]))) / self.dt
                                                            for p, q in zip(window, window[1:])), 2, "mm/s")


class Brake(Case):
    """A block slides down a slope of 25 degrees that becomes level: mu g brings it to rest, where it stays.

    Its way is that of backward Euler steps with these accelerations.
    """

    name, source = "brake", "Coulomb: kinetic friction against a motion"
    mu, angle, falls = 0.3, 25.0, 0.1

    def build(self, s):
        slab(s, self.mesh, young=1e6)
        b = block(s, self.mesh, "block", (10, 10, 0.01), young=1e6)
        s.contact("slab", "block", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        self.settled = s.steps(0.1)
        s.gravity(self.angle)
        self.slides = s.steps(self.falls)
        s.gravity()
        self.brakes = s.steps(0.2)
        self.faces = [("block", b.where(lambda p: p[2] < 0.011), (0, 0, 1))]

    def judge(self, s, frames):
        x = [s.models["block"].centre(f.shapes["block"])[0] for f in frames]
        a = math.radians(self.angle)
        faster = GRAVITY * (math.sin(a) - self.mu * math.cos(a))
        speed, way = 0.0, 0.0
        for _ in range(self.slides):
            speed += self.dt * faster
            way += self.dt * speed
        first = self.settled + self.slides
        slower = math.floor(speed / (self.mu * GRAVITY * self.dt))  # steps in which it moves to their end
        while speed > 0:
            speed = max(0.0, speed - self.dt * self.mu * GRAVITY)
            way += self.dt * speed
        yield near("way until it rests", x[-1] - x[self.settled - 1], way, 0.01 * way, "mm")
        window = frames[first: first + slower]
        # The block shears back where the slope goes: the mean of the rest counts.
        ratio = mean(-self.force(f, "block")[0] for f in window) / mean(self.force(f, "block")[2] for f in window)
        yield near("tangential over normal force while it brakes", ratio, self.mu, 0.01 * self.mu)
        yield at_most("way behind its rest", max(abs(x[-1] - v) for v in x[first + slower + 3:]), 2 * EPS_V * 0.2 + 0.01, "mm")


class Belt(Case):
    """A block on a belt that runs by 60 mm in 0.25 s, by 3 t^2 - 2 t^3, with up to twice the acceleration mu g.

    Where it slips, mu g takes it along. Its way is that of backward Euler steps with this acceleration.
    """

    name, source = "belt", "Coulomb: kinetic friction that drives"
    mu, way, lasts = 0.3, 60.0, 0.25

    def build(self, s):
        cells = (4, 2, 1) if self.mesh == "coarse" else (16, 4, 1)
        s.solid("slab", box(cells, (160, 40, 5), (0, 0, -5)), 1e5)
        b = block(s, self.mesh, "block", (70, 10, 0.01))
        s.contact("slab", "block", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        s.line("displace slab all 0 0 0")
        self.settled = s.steps(0.1)
        self.runs = round(self.lasts / self.dt)
        s.line(f"displace slab all {self.way!r} 0 0 over {self.runs * self.dt!r}")
        s.lines += ["step"] * self.runs
        self.closed = False  # forces of the belt's support are told among the others
        self.faces = [("block", b.where(lambda p: p[2] < 0.011), (0, 0, 1))]

    def judge(self, s, frames):
        x = [s.models["block"].centre(f.shapes["block"])[0] for f in frames]
        at = lambda k: self.way * (3 - 2 * k / self.runs) * (k / self.runs) ** 2
        way, speed, slips, most = 0.0, 0.0, [], self.dt * self.mu * GRAVITY
        for k in range(1, self.runs + 1):
            belt = (at(k) - at(k - 1)) / self.dt
            if speed + most < belt:
                slips.append(k)
            speed = min(max(belt, speed - most), speed + most)
            way += self.dt * speed
        yield near("way of the block", x[-1] - x[self.settled - 1], way, 0.01 * way, "mm")
        # A block that is not rigid shears before it is drawn along: at first it falls back by 2 to 3 mm/s.
        yield near("lag behind the belt", self.way - (x[-1] - x[self.settled - 1]), self.way - way, 0.3, "mm")
        window = [frames[self.settled + k - 1] for k in slips]
        if window:
            ratio = mean(self.force(f, "block")[0] for f in window) / mean(self.force(f, "block")[2] for f in window)
            yield near("tangential over normal force while it slips", ratio, self.mu, 0.01 * self.mu)


class Push(Case):
    """A plate pushes a block over a table, by 3 t^2 - 2 t^3: it feels mu m g and what the acceleration takes."""

    name, source = "push", "Coulomb"
    mu, way, lasts = 0.3, 20.0, 1.0

    def build(self, s):
        slab(s, self.mesh)
        block(s, self.mesh, "block", (20, 10, 0.01), turn=0.0)
        s.contact("slab", "block", self.mu)
        s.gravity()
        turn = "turn 0 1 0 90"
        start = 20.0 - 2.6 - 0.5 - 1.0
        s.mesh_instrument("plate", plate((6, 30, 2)), (start, 20, 5), turn)
        s.emit("shapes", "forces", "instruments")
        s.steps(0.1)
        self.runs = round(self.lasts / self.dt)
        s.line(f"move plate {start + self.way!r} 20 5 {turn} over {self.runs * self.dt!r}")
        s.lines += ["step"] * self.runs

    def judge(self, s, frames):
        weight = s.models["block"].weight * GRAVITY
        mass = s.models["block"].weight
        run = frames[-self.runs:]
        for name, first, last in (("while it becomes faster", 0.45, 0.5), ("while it becomes slower", 0.75, 0.95)):
            some = range(round(first * self.runs), round(last * self.runs))
            force = -mean(run[k].instruments["plate"][1][0] for k in some)
            gains = mean(6 * self.way / (self.runs * self.dt) ** 2 * (1 - 2 * (k + 0.5) / self.runs) for k in some)
            yield near(f"force on the plate over theory, {name}", force / (mass * (self.mu * GRAVITY + gains)), 1, 0.01)
        yield near("normal force over m g", -mean(self.force(f, "slab")[2] for f in run[self.runs // 2:]) / (mass * GRAVITY), 1, 0.01)


class Ladder(Case):
    """A board of length L and thickness t leans at a smooth wall: it holds where tan(angle) < 2 mu + t / L.

    `angle` is that against the vertical. Moments about its foot give the force of the wall, W (tan(angle) - t / L) / 2, which
    is that of friction at the foot.
    """

    name, source = "ladder", "statics: moments about the foot; Coulomb"
    mu, angle, long, thick = 0.4, 38.0, 60.0, 4.0

    def build(self, s):
        a, t = math.radians(self.angle), self.thick
        n = {"aligned": (1, 2, 10), "turned": (2, 3, 13), "coarse": (1, 1, 5)}[self.mesh]
        along, across = (math.sin(a), math.cos(a)), (math.cos(a), -math.sin(a))
        lowest = -t / 2 * math.sin(a)
        at = lambda p: (p[2] * along[0] + p[0] * across[0], p[1], p[2] * along[1] + p[0] * across[1] - lowest + 0.01)
        s.solid("board", mapped(box(n, (t, 10, self.long), (-t / 2, -5, 0)), at), 1e6, drag=5)
        wall = self.long * math.sin(a) + t / 2 * math.cos(a) + 0.01
        cells = (1, 1, 1) if self.mesh == "coarse" else (1, 3, 3)
        s.solid("wall", box(cells, (5, 40, 40), (wall, -20, self.long * math.cos(a) - 20)), 1e6, fix=f"x>{wall + 4.99!r}")
        s.solid("floor", box((*cells[1:], 1), (60, 40, 5), (-40, -20, -5)), 1e6, fix="z<-4.99")
        s.contact("board", "wall")
        s.contact("board", "floor", self.mu)
        s.emit("shapes", "forces")
        # The weight comes slowly: a sudden one swings the board, and its foot slips while it carries more than the weight.
        grows = round(0.3 / self.dt)
        for k in range(grows):
            s.gravity(size=GRAVITY * (k + 1) / grows)
            s.line("step")
        self.count = s.steps(0.5)

    def judge(self, s, frames):
        board = s.models["board"]
        moved = [norm(sub(board.centre(f.shapes["board"]), board.centre())) for f in frames]
        if math.tan(math.radians(self.angle)) < 2 * self.mu + self.thick / self.long:
            yield at_most("way of the board that holds", moved[-1], 0.5, "mm")
            window = frames[-self.count // 4:]
            push = mean(self.force(f, "wall")[0] for f in window)
            theory = board.weight * GRAVITY * (math.tan(math.radians(self.angle)) - self.thick / self.long) / 2
            yield near("force on the wall over theory", push / theory, 1, 0.02)
            # Below, the same force: the wall is smooth.
            yield near("force of friction on the floor over that on the wall", -mean(self.force(f, "floor")[0] for f in window) / push, 1, 0.01)
        else:
            yield at_least("way of the board that slips", moved[-1], 5, "mm")


class Groove(Case):
    """A ball in a groove of two smooth planes at 45 degrees: each bears W / sqrt(2)."""

    name, source = "groove", "statics"

    def build(self, s):
        cells = {"aligned": 4, "turned": 5, "coarse": 3}[self.mesh]
        b = s.solid("ball", ball(cells, 8.0, (0, 0, 8 * math.sqrt(2) + 0.02), degrees=turn_of(self.mesh)), 2e4, drag=20)
        n = 1 if self.mesh == "coarse" else 4
        for name, side in (("left", -1), ("right", 1)):
            s.solid(name, mapped(box((n, n, 1), (30, 30, 4), (-5, -15, -4)), lambda p: turned((side * p[0], p[1], p[2]), (0, 1, 0), -side * 45)),
                    1e5, fix="all")
            s.contact(name, "ball")
        s.gravity()
        s.emit("shapes", "forces")
        self.count = s.steps(0.6)
        self.weight = b.weight * GRAVITY

    def judge(self, s, frames):
        window = frames[-self.count // 4:]
        for name, side in (("left", -1), ("right", 1)):
            force = mean(dot(self.force(f, name), (side / math.sqrt(2), 0, -1 / math.sqrt(2))) for f in window)
            yield near(f"normal force of the {name} plane over W / sqrt(2)", force / self.weight * math.sqrt(2), 1, 0.01)
            along = max(abs(dot(self.force(f, name), (1 / math.sqrt(2), 0, side / math.sqrt(2)))) for f in window)
            # 1e-5 at rest; up to half a per cent for the moments in which an edge of the ball rolls over one of the plane.
            yield at_most(f"force along the {name} plane over W", along / self.weight, 0.01)


class Plate(Case):
    """A block between a frictionless base and a wide rigid plate without friction: uniform stress, F = E A d / h.

    d is the mean depth of the upper face, so that the gap of the contact does not count. Any mesh holds this state exactly.
    """

    name, source = "plate", "uniaxial stress; the patch test of contact"
    young = 2e4

    def build(self, s):
        n = {"aligned": (4, 4, 2), "turned": (5, 5, 2), "coarse": (1, 1, 1)}[self.mesh]
        b = s.solid("block", box(n, (20, 20, 10), (0, 0, 0)), self.young, 0.3, words="method=ffe",
                    fix=[("z<0.001", "z"), ("near:0,0,0,0.1", "xyz"), ("near:20,0,0,0.1", "yz")])
        turn = f"turn 0 0 1 {turn_of(self.mesh)!r} " if self.mesh == "turned" else ""
        s.mesh_instrument("plate", plate((50, 50, 10)), (10, 10, 15.51), turn)
        s.emit("shapes", "forces", "instruments")
        turn = f" {turn}".rstrip()
        for k in range(1, 5):
            s.line(f"move plate 10 10 {15.51 - 0.06 * k!r}{turn}")
            s.line("step 0.1")
        self.top = b.where(lambda p: p[2] > 9.999)
        self.faces = [("block", self.top, (0, 0, -1))]

    def judge(self, s, frames):
        shape, b = frames[-1].shapes["block"], s.models["block"]
        corners = [n for n in self.top]
        depth = 10 - mean(shape[n][2] for n in corners)
        force = -self.force(frames[-1], "block")[2]
        yield near("force over E A d / h", force / (self.young * 400 * depth / 10), 1, 0.005)
        yield near("depth of the face over that of the plate", depth / 0.23, 1, 0.05)
        yield at_most("unevenness of the face", max(shape[n][2] for n in corners) - min(shape[n][2] for n in corners), 0.005, "mm")
        yield near("force on the plate over that on the block", frames[-1].instruments["plate"][1][2] / force, 1, 1e-9)


def graded(across, radius, out):
    """Places from 0: even to beyond a touched circle, then wider and wider up to `out` radii."""
    at, cell = [0.0], radius / across
    while at[-1] < 1.2 * radius:
        at.append(at[-1] + cell)
    ratio = 2 ** (3 / across)
    width = cell * ratio
    while at[-1] < out * radius:
        at.append(at[-1] + width)
        width *= ratio
    return at


def sneddon(young, poisson, radius, depth):
    """Force and radius of the touched circle of a rigid sphere pressed into a half-space: exact for the sphere, not its paraboloid."""
    low, high = 0.0, radius * 0.999
    for _ in range(200):
        a = (low + high) / 2
        low, high = (a, high) if a / 2 * math.log((radius + a) / (radius - a)) < depth else (low, a)
    return young / (1 - poisson**2) * ((a * a + radius * radius) / 2 * math.log((radius + a) / (radius - a)) - a * radius), a


class Hertz(Case):
    """A rigid sphere of 10 mm pressed 0.2 mm into a quarter of a block with planes of symmetry, 240 times as large as the touched circle.

    The half-space: Sneddon's force of the sphere, which Hertz's 4/3 E / (1 - nu^2) sqrt(R d^3) is the limit of. Two meshes, one
    of half the edges, are pressed side by side; the error of elements goes with the square of the edge, so that a third of the
    difference of both forces is taken off the finer one's (Richardson), and what is left is that of the contact. On an irregular
    mesh of linear elements it goes with less than the square: 4.4 % are left there, 3.8 % at two thirds of the edge.
    """

    name, source = "hertz", "Hertz 1881; Sneddon 1965; Johnson, Contact mechanics, 1985, section 4.2"
    young, radius, depth, count = 1e4, 10.0, 0.2, 2
    limit = 240.0

    def build(self, s):
        self.poisson = 0.45 if self.order == 2 else 0.3
        self.expect, a = sneddon(self.young, self.poisson, self.radius, self.depth)
        finer = {"aligned": 4, "turned": 4, "coarse": 3}[self.mesh] * (2 if self.order == 1 else 1)
        self.places = {}
        for name, across in (("fine", finer), ("rough", finer / 2)):
            at = graded(across, a, 240)
            n, far, x0 = len(at) - 1, at[-1], 1000.0 * len(self.places)
            self.places[name] = x0

            def place(i, j, k):
                x, y, z = at[i], at[j], -at[n - k]
                if self.mesh == "turned" and 0 < i < n and 0 < j < n:  # an irregular grid
                    x += 0.15 * (at[i + 1] - at[i]) * math.sin(5 * i + 3 * j + k)
                    y += 0.15 * (at[j + 1] - at[j]) * math.cos(3 * i + 5 * j + k)
                return (x0 + x, y, z)

            s.solid(name, grid((n, n, n), place), self.young, self.poisson, words="method=ffe",
                    fix=[(f"x<{x0 + 1e-9!r}", "x"), ("y<1e-9", "y"), (f"x>{x0 + 0.999 * far!r} or y>{0.999 * far!r} or z<{-0.999 * far!r}", "xyz")])
            s.line(f"instrument {name} sphere {self.radius!r} {x0!r} 0 {self.radius + 0.02!r}")
        s.emit("forces", "instruments", "surfaces")
        for k in range(1, self.count + 1):
            for name, x0 in self.places.items():
                s.line(f"move {name} {x0!r} 0 {self.radius - self.depth * k / self.count!r}")
            s.line("step 0.1")

    def judge(self, s, frames):
        fine, rough = (4 * frames[-1].instruments[n][1][2] / self.expect for n in ("fine", "rough"))
        yield near("force over that of the half-space, extrapolated", fine + (fine - rough) / 3, 1, 0.02 if self.order == 2 else 0.05)
        yield shown("force over that of the half-space, finer mesh", fine)
        yield shown("force over that of the half-space, rougher mesh", rough)


class Mindlin(Case):
    """A rigid sphere pressed into a block, then moved along it: partial slip.

    Cattaneo and Mindlin: Q = mu P (1 - (1 - x / x1)^(3/2)) with x1 = 3/2 mu P / k, k the stiffness against sticking, which is
    measured on an equal block that sticks (mu 20), so that the elements' own error does not count. For the half-space it is 8 a G / (2 - nu).
    Linear elements are taken of half the edge; 4.6 to 5.3 % are left there, 10 to 13 % at the whole edge.
    """

    name, source = "mindlin", "Cattaneo 1938; Mindlin 1949; Johnson 1985, section 7.2"
    young, radius, depth, mu = 1e4, 10.0, 0.2, 0.3
    limit = 240.0

    def build(self, s):
        self.poisson = 0.45 if self.order == 2 else 0.3  # linear elements lock
        self.expect, self.a = sneddon(self.young, self.poisson, self.radius, self.depth)
        at = graded({"aligned": 4, "turned": 4, "coarse": 3}[self.mesh] * (2 if self.order == 1 else 1), self.a, 20)
        n, far = len(at) - 1, at[-1]
        along = [-x for x in reversed(at[1:])] + at
        for name, x0 in (("slips", 0.0), ("sticks", 4 * far)):
            def place(i, j, k, x0=x0):
                x, y, z = along[i], at[j], -at[n - k]
                if self.mesh == "turned" and 0 < i < 2 * n and 0 < j < n:
                    y += 0.15 * (at[j + 1] - at[j]) * math.cos(3 * i + 5 * j + k)
                return (x0 + x, y, z)
            s.solid(name, grid((2 * n, n, n), place), self.young, self.poisson, words="method=ffe",
                    fix=[("y<1e-9", "y"), (f"x<{x0 - 0.999 * far!r} or x>{x0 + 0.999 * far!r} or y>{0.999 * far!r} or z<{-0.999 * far!r}", "xyz")])
            s.line(f"instrument {name} sphere {self.radius!r} {x0!r} 0 {self.radius + 0.02!r} friction {self.mu if name == 'slips' else 20.0!r}")
        shear = self.young / 2 / (1 + self.poisson)
        self.x1 = 1.5 * self.mu * self.expect / (8 * self.a * shear / (2 - self.poisson))
        s.emit("forces", "instruments", "surfaces")
        for z in (0.5, 1.0):
            for name, x0 in (("slips", 0.0), ("sticks", 4 * far)):
                s.line(f"move {name} {x0!r} 0 {self.radius - self.depth * z!r}")
            s.line("step 0.1")
        self.ways = [self.x1 * k / 8 for k in range(1, 11)]
        for way in self.ways:
            for name, x0 in (("slips", 0.0), ("sticks", 4 * far)):
                s.line(f"move {name} {x0 + way!r} 0 {self.radius - self.depth!r}")
            s.line("step 0.1")

    def judge(self, s, frames):
        press, moved = frames[1], frames[2:]
        force = lambda f, n: f.instruments[n][1]
        first = moved[0]
        k = (force(first, "sticks")[0] - force(press, "sticks")[0]) / self.ways[0]
        shear = self.young / 2 / (1 + self.poisson)
        yield shown("stiffness against sticking over 8 a G / (2 - nu)", abs(2 * k) / (8 * self.a * shear / (2 - self.poisson)))
        worst, found = 0.0, 0.0
        for f, way in zip(moved, self.ways):
            p = abs(force(f, "slips")[2])
            x1 = 1.5 * self.mu * p / abs(k)
            theory = 1 - max(0.0, 1 - way / x1) ** 1.5
            q = abs(force(f, "slips")[0] - force(press, "slips")[0]) / (self.mu * p)
            if abs(q - theory) > abs(found - worst):
                worst, found = theory, q
        yield near("tangential force over mu P, worst of ten ways", found, worst, 0.05 if self.order == 2 else 0.06)
        yield near("tangential force over mu P at full slip", abs(force(moved[-1], "slips")[0]) / (self.mu * abs(force(moved[-1], "slips")[2])), 1, 0.02)


class Capstan(Case):
    """A strip round a quarter of a fixed cylinder, loaded at one end and drawn slowly at the other: T1 / T2 = exp(mu phi).

    The strip of thickness t has its tension at R + t / 2 and its friction at R: moments about the axis give the exponent
    mu phi R / (R + t / 2).
    """

    name, source = "capstan", "Euler 1769; Eytelwein 1808"
    mu, radius, load, kind = 0.3, 10.0, 1e4, "solid"
    limit = 120.0

    def build(self, s):
        arc, tail, across = {"aligned": (12, 12, 2), "turned": (15, 17, 3), "coarse": (8, 8, 1)}[self.mesh]
        self.thick = 0.3 if self.kind == "solid" else 0.0
        sag = self.radius * (1 / math.cos(math.pi / 4 / arc) - 1)
        inner, lengths = self.radius + 0.02 + sag, (15.0, 30.0)

        def place(i, r):
            if i < tail:
                return (-lengths[0] * (tail - i) / tail, r)
            if i <= tail + arc:
                angle = math.pi / 2 * (i - tail) / arc
                return (r * math.sin(angle), r * math.cos(angle))
            return (r, -lengths[1] * (i - tail - arc) / (2 * tail))

        n = 3 * tail + arc
        width = lambda j: -3 + 6 * j / across
        if self.kind == "solid":
            def at(i, j, k):
                x, z = place(i, inner + self.thick * k)
                return (x, width(j), z)
            m = s.solid("strip", grid((n, across, 1), at), 2e5, 0.3, drag=5)
        else:
            def flat(i, j):
                x, z = place(i, inner)
                return (x, width(j), z)
            m = s.net("strip", sheet(n, across, flat), young=1e6, thickness=0.3, drag=5, bend=False)
        s.line(f"instrument drum capsule {self.radius!r} 0 -8 0 0 8 0 friction {self.mu!r}")
        self.tools = [("drum", self.radius, (0, 16, 0))]
        pulled = m.where(lambda p: p[0] < -14.999)
        self.supports = {"strip": set(pulled)}
        hanging = m.where(lambda p: p[2] < -29.999)
        s.emit("shapes", "forces", "instruments")
        s.line(f"displace strip {','.join(map(str, pulled))} 0 0 0")
        for k in range(10):
            s.line(f"force strip {','.join(map(str, hanging))} 0 0 {-self.load * (k + 1) / 10!r} total")
            s.line("step 0.02")
        s.steps(0.2, 0.02)
        self.closed = False  # the support at the pulled end is told among the forces, by nodes that touch nothing
        self.speed = 15.0
        s.line(f"displace strip {','.join(map(str, pulled))} {-self.speed!r} 0 0 over 1")
        self.last = s.steps(1.0, 1 / 60)
        self.pulled = pulled

    def judge(self, s, frames):
        window = frames[-int(0.6 * self.last): -int(0.25 * self.last)]
        t1 = -mean(total(f.forces["strip"][n] for n in self.pulled if n in f.forces["strip"])[0] for f in window)
        drum = [f.instruments["drum"][1] for f in window]
        t2 = self.load
        theory = math.exp(self.mu * math.pi / 2 * self.radius / (self.radius + self.thick / 2))
        # Linear elements, one layer thick, lock where the strip is bent: that takes force, by the square of their length.
        locks = self.kind == "solid" and self.order == 1 and self.mesh != "turned"
        yield near("tension ratio", t1 / t2, theory, (0.08 if locks else 0.03) * theory)
        # The drum bears both tensions: (-T1, -T2) along x and z.
        yield near("horizontal force on the drum over the pull", mean(f[0] for f in drum) / -t1, 1, 0.02)
        yield near("vertical force on the drum over the load", mean(f[2] for f in drum) / -t2, 1, 0.04 if locks else 0.02)


class Wedge(Case):
    """A wedge of half angle alpha between two rigid jaws that close by 0.2 mm each in a second: it holds where tan(alpha) < mu.

    Else it is squeezed out towards its wide side by the way of a jaw over tan(alpha).
    """

    name, source = "wedge", "Coulomb: the cone of friction"
    alpha, mu, closing = 20.0, 0.3, 0.2

    def build(self, s):
        a = math.radians(self.alpha)
        n = {"aligned": (2, 2, 2), "turned": (3, 3, 4), "coarse": (1, 1, 1)}[self.mesh]
        w = s.solid("wedge", grid(n, lambda i, j, k: ((2 * i / n[0] - 1) * (4 + 10 * k / n[2] * math.tan(a)), -4 + 8 * j / n[1], 10 * k / n[2])),
                    2e4, drag=50)
        places = {}
        for name, side in (("right", 1), ("left", -1)):
            normal = (side * math.cos(a), 0, -math.sin(a))
            middle = (side * (4 + 5 * math.tan(a)), 0, 5)
            places[name] = add(middle, scale(1.51 + 0.5, normal))
            s.mesh_instrument(name, plate((3, 20, 30)), places[name], f"turn 0 1 0 {side * self.alpha!r} friction {self.mu!r}")
        s.emit("shapes", "forces", "instruments")
        for name, side in (("right", 1), ("left", -1)):
            s.line(f"move {name} {words_of(sub(places[name], (side * (self.closing + 0.01 / math.cos(a)), 0, 0)))} turn 0 1 0 {side * self.alpha!r} over 1")
        s.steps(1.05, 0.05)

    def judge(self, s, frames):
        a = math.radians(self.alpha)
        up = s.models["wedge"].centre(frames[-1].shapes["wedge"])[2] - s.models["wedge"].centre()[2]
        if math.tan(a) < self.mu:
            yield at_most("way of the wedge that holds", abs(up), 2 * EPS_V * 1.05, "mm")
            right = frames[-1].instruments["right"][1]
            left = frames[-1].instruments["left"][1]
            # In equilibrium the vertical forces of both jaws cancel, whatever the share of each.
            yield at_most("vertical over horizontal force on both jaws", abs(right[2] + left[2]) / (abs(right[0]) + abs(left[0])), 0.01)
            along, across = (math.sin(a), 0, math.cos(a)), (math.cos(a), 0, -math.sin(a))
            t = dot(right, along) + dot((-left[0], 0, left[2]), along)
            n = dot(right, across) + dot((-left[0], 0, left[2]), across)
            yield near("tangential over normal force of both jaws", abs(t / n), math.tan(a), 0.01 * math.tan(a))
        else:
            yield near("way of the wedge that is squeezed out", up, self.closing / math.tan(a), 0.1 * self.closing / math.tan(a), "mm")


class House(Case):
    """Two posts and a lintel at rest.

    A post bears the share of the lintel that moments about the middle of the other post's pressure give. Where these middles
    lie is not determined by statics (the lintel bends, and meshes are not symmetric), so they are taken from the told forces.
    """

    name, source = "house", "statics"
    mu = 0.5
    limit = 120.0

    def build(self, s):
        n = {"aligned": 1, "turned": 2, "coarse": 1}[self.mesh]
        slab(s, self.mesh, length=80, young=1e6)
        for name, x in (("left", 10), ("right", 50)):
            p = s.solid(name, box((n + 1, n + 1, 2 * n), (10, 10, 20), (x, 15, 0.01), turn_of(self.mesh)), 1e5)
            self.faces += [(name, p.where(lambda q: q[2] < 0.0101), (0, 0, 1)), (name, p.where(lambda q: q[2] > 20.0099), (0, 0, -1))]
            s.contact("slab", name, self.mu)
        l = s.solid("lintel", box((6 * n, n, n), (60, 12, 8), (5, 14, 20.02)), 1e5)
        s.contact("left", "lintel", self.mu)
        s.contact("right", "lintel", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        s.steps(0.8)
        low = l.where(lambda q: q[2] < 20.0201)
        self.halves = [[q for q in low if (l.rest[q][0] < 35) == (k == 0)] for k in range(2)]

    def judge(self, s, frames):
        window = [f for f in frames if f.time > 0.7]
        lintel, post = (s.models[n].weight * GRAVITY for n in ("lintel", "left"))
        place, borne, middle = [0.0, 0.0], [0.0, 0.0], 0.0
        for k in range(2):
            of = [(f.shapes["lintel"][n][0], f.forces["lintel"][n][2]) for f in window for n in self.halves[k] if n in f.forces["lintel"]]
            borne[k] = math.fsum(z for _, z in of) / len(window)
            place[k] = math.fsum(x * z for x, z in of) / math.fsum(z for _, z in of)
        middle = mean(s.models["lintel"].centre(f.shapes["lintel"])[0] for f in window)
        for k, name in enumerate(("left", "right")):
            share = abs(place[1 - k] - middle) / abs(place[1] - place[0])
            yield near(f"force of the {name} post on the lintel over its share", borne[k] / (share * lintel), 1, 0.005)
            low = mean(self.force(f, name, self.faces[2 * k][1])[2] for f in window)
            yield near(f"force under the {name} post over its weight and share", low / (share * lintel + post), 1, 0.005)
        yield at_most("drift in 0.1 s", max(norm(sub(s.models[n].centre(window[-1].shapes[n]), s.models[n].centre(window[0].shapes[n])))
                                        for n in ("left", "right", "lintel")), 2 * EPS_V * 0.1, "mm")


class Arch(Case):
    """Seven voussoirs in half a circle, a third of the radius thick, under their weight: they stand, and each foot bears half.

    The least thickness of half a circle is 0.107 of the radius, the least friction some 0.4.
    """

    name, source = "arch", "Heyman, The stone skeleton, 1966"
    mu, count, radius, thick = 0.7, 7, 30.0, 10.0
    limit = 180.0

    def build(self, s):
        n = {"aligned": (2, 2, 2), "turned": (2, 3, 3), "coarse": (1, 1, 1)}[self.mesh]
        m = (2, 1) if self.mesh == "coarse" else (9, 4)
        s.solid("slab", box((*m, 1), (90, 40, 5), (-45, -20, -5)), 1e6, fix="z<-4.99")
        gap = 0.01
        for k in range(self.count):
            def place(i, j, l, k=k):
                r = self.radius - self.thick / 2 + self.thick * i / n[0]
                low, high = math.pi * k / self.count, math.pi * (k + 1) / self.count
                t = low + (high - low) * l / n[2]
                x, z = r * math.cos(t), r * math.sin(t)
                # Apart from each other along the arch, and above the slab.
                middle = (low + high) / 2
                return (x + 0.02 * math.cos(middle), -5 + 10 * j / n[1], z + gap + 0.02 * math.sin(middle))
            s.solid(f"v{k}", grid(n, place), 1e6)
            s.contact(f"v{k - 1}" if k else "slab", f"v{k}", self.mu)
        s.contact("slab", f"v{self.count - 1}", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        s.steps(0.8)

    def judge(self, s, frames):
        window = [f for f in frames if f.time > 0.7]
        names = [f"v{k}" for k in range(self.count)]
        weight = sum(s.models[n].weight for n in names) * GRAVITY
        # A coarse slab has nodes that both feet press: each foot's force is that on its own lowest nodes.
        feet = {side: (name, set(s.models[name].where(lambda p: p[2] < 0.1))) for side, name in ((1, names[0]), (-1, names[-1]))}
        down = lambda f, side: scale(-1, self.force(f, *feet[side]))
        yield near("force on the slab over the weight", mean(self.force(f, "slab")[2] for f in window) / -weight, 1, 0.005)
        yield near("of this by the right foot", mean(down(f, 1)[2] for f in window) / -weight, 0.5, 0.005)
        yield near("thrusts of both feet over the weight, sum", mean(down(f, 1)[0] + down(f, -1)[0] for f in window) / weight, 0, 0.005)
        yield at_most("drift in 0.1 s", max(norm(sub(s.models[n].centre(window[-1].shapes[n]), s.models[n].centre(window[0].shapes[n])))
                                        for n in names), 2 * EPS_V * 0.1 * self.count, "mm")


class Hole(Slope):
    """A square rod in a square hole with 0.02 mm of room on each side, tilted after a rest: it slides as on a plane and does not jam.

    Theory as of the slope.
    """

    name, source = "hole", "Coulomb 1785"
    angle, mu = 30.0, 0.0

    def build(self, s):
        self.theory()
        n = {"aligned": 8, "turned": 9, "coarse": 3}[self.mesh]
        places = (-10.0, -5.02, 5.02, 10.0)
        points, cells = grid((n, 3, 3), lambda i, j, k: (80 * i / n, places[j], places[k]))
        inside = lambda c: all(abs(sum(points[q][a] for q in c) / 4) < 5.02 for a in (1, 2))
        kept = [c for c in cells if not inside(c)]
        used = sorted({q for c in kept for q in c})
        number = {q: k for k, q in enumerate(used)}
        s.solid("slab", ([points[q] for q in used], [tuple(number[q] for q in c) for c in kept]), 1e6, fix="z<-9.99 or z>9.99")
        rod = {"aligned": (3, 2, 2), "turned": (5, 3, 3), "coarse": (2, 1, 1)}[self.mesh]
        b = s.solid("block", box(rod, (30, 10, 10), (5, -5, -5)), 1e6)
        s.contact("slab", "block", self.mu)
        s.gravity()
        s.emit("shapes", "forces")
        s.steps(0.1)
        self.settled = round(0.1 / self.dt)
        s.gravity(self.angle)
        self.slides = s.steps(min(0.25, math.sqrt(2 * 35 / self.acceleration)) if self.acceleration > 0 else 0.25)
        self.weight = b.weight * GRAVITY


class Flaps(Case):
    """A sphere pushed through two flaps: it never passes into them, and behind it they go back to rest."""

    name, source = "flaps", "elasticity: no load, no displacement"
    mu = 0.3
    limit = 120.0

    def build(self, s):
        n = {"aligned": (6, 4, 1), "turned": (9, 5, 1), "coarse": (4, 2, 1)}[self.mesh]
        s.solid("left", box(n, (20, 16, 1.5), (-20.5, -8, 0)), 5e4, drag=20, fix="x<-20.49", words="damping=0.3@20")
        s.solid("right", box(n, (20, 16, 1.5), (0.5, -8, 0)), 5e4, drag=20, fix="x>20.49", words="damping=0.3@20")
        s.contact("left", "right", self.mu)
        s.line(f"instrument ball sphere 4 0 0 6 friction {self.mu!r}")
        self.tools = [("ball", 4.0, (0, 0, 0))]
        s.emit("shapes", "forces", "instruments")
        s.line("move ball 0 0 -20 over 0.8")
        s.steps(0.8, 0.02)
        s.steps(0.6, 0.1)

    def judge(self, s, frames):
        yield at_least("largest upward force on the ball, 1e-6 N", max(f.instruments["ball"][1][2] for f in frames), 1000)
        last = frames[-1]
        yield at_most("distance from rest, in the end", max(norm(sub(p, q)) for n in ("left", "right") for p, q in zip(last.shapes[n], s.models[n].rest)), 0.05, "mm")
        yield at_most("force on the ball, in the end", norm(last.instruments["ball"][1]), 1e-6)


class Sheet(Case):
    """A net laid on a fixed sphere with friction hangs at rest: the sphere bears its weight."""

    name, source = "sheet on a sphere", "statics"
    mu = 0.6
    limit = 120.0

    def build(self, s):
        n = {"aligned": 16, "turned": 20, "coarse": 8}[self.mesh]
        spin = lambda p: turned(p, (0, 0, 1), turn_of(self.mesh))
        s.net("sheet", sheet(n, n, lambda i, j: spin((-20 + 40 * i / n, -20 + 40 * j / n, 10.05))), young=1e5, drag=10)
        s.line(f"instrument ball sphere 10 0 0 0 friction {self.mu!r}")
        self.tools = [("ball", 10.0, (0, 0, 0))]
        self.pairs = []
        s.gravity()
        s.emit("shapes", "forces", "instruments")
        s.steps(2.0, 0.1)
        self.last = s.steps(0.1)

    def judge(self, s, frames):
        weight = s.models["sheet"].weight * GRAVITY
        yield near("force on the sphere over the weight", mean(f.instruments["ball"][1][2] for f in frames[-self.last:]) / -weight, 1, 0.01)


class FoldedTube(Case):
    """A tube of membrane, held at its ends, pinched flat between two capsules and let go: its walls never pass through each other."""

    name, source = "folded tube", "geometry"
    mu = 0.3
    limit = 120.0

    def build(self, s):
        n = {"aligned": (16, 14), "turned": (20, 17), "coarse": (10, 8)}[self.mesh]
        s.net("tube", tube(*n, 6, 40), young=1e5, drag=10, fix="x<0.01 or x>39.99")
        s.contact("tube", "self", self.mu)
        for name, side in (("low", -1), ("high", 1)):
            s.line(f"instrument {name} capsule 2 {words_of((20, -12, side * 8.5), (20, 12, side * 8.5))} friction {self.mu!r}")
            self.tools.append((name, 2.0, (0, 24, 0)))
        s.emit("shapes", "forces", "instruments")
        for name, side in (("low", -1), ("high", 1)):
            s.line(f"move {name} {words_of((20, -12, side * 2.3))} over 0.5")
        s.steps(0.6, 0.02)
        for name, side in (("low", -1), ("high", 1)):
            s.line(f"move {name} {words_of((20, -12, side * 8.5))} over 0.3")
        s.steps(0.4, 0.05)

    def judge(self, s, frames):
        low, high = (frames[29].instruments[n][1] for n in ("low", "high"))
        yield at_least("pinch borne by both capsules, 1e-6 N", min(-low[2], high[2]), 1)


class Wound(Case):
    """A bar of Poisson's ratio 0 cut half through, its walls pressed together: it bears as if it were whole, F = E A d / L."""

    name, source = "wound", "uniaxial stress"
    young, mu = 1e4, 0.5
    limit = 120.0

    def build(self, s):
        n = {"aligned": (6, 2, 2), "turned": (7, 3, 3), "coarse": (3, 1, 2)}[self.mesh]
        b = s.solid("bar", box(n, (30, 10, 10), (0, 0, 0)), self.young, 0.0, drag=20, fix="x<0.001")
        pushed = b.where(lambda p: p[0] > 29.999)
        s.contact("bar", "self", self.mu)
        s.line('cut bar plane 14 0 0 1 0 0 "z>4.9"')
        s.emit("shapes", "forces")
        names = ",".join(map(str, pushed))
        s.line(f"displace bar {names} -0.3 0 0 over 0.4")
        s.steps(0.8, 0.1)
        self.pushed = pushed
        self.closed = False

    def judge(self, s, frames):
        force = -total(frames[-1].forces["bar"][n] for n in self.pushed if n in frames[-1].forces["bar"])[0]
        yield near("force over E A d / L", force / (self.young * 100 * 0.3 / 30), 1, 0.01)
        others = [v for n, v in frames[-1].forces["bar"].items() if n not in self.pushed]
        size = math.fsum(map(norm, others))
        yield at_most("sum of forces of the walls over their lengths", norm(total(others)) / size if size else 0, ROUNDING)


class Grasp(Case):
    """A block held by two flat jaws with a growing weight: it slips where m g = 2 mu N.

    N is the force that the jaws feel. The weight grows by 2 % of the expected limit in each of 65 steps.
    """

    name, source = "grasp", "Coulomb 1785"
    mu = 0.5

    def build(self, s):
        n = {"aligned": (2, 2, 2), "turned": (3, 3, 3), "coarse": (1, 1, 1)}[self.mesh]
        b = s.solid("block", box(n, (10, 10, 10), (-5, -5, -5)), 2e4, drag=0)
        for name, side in (("right", 1), ("left", -1)):
            turn = f" turn 1 0 0 {turn_of(self.mesh)!r}" if self.mesh == "turned" else ""
            s.mesh_instrument(name, plate((2, 30, 30)), (side * 6.51, 0, 0), f"{turn} friction {self.mu!r}")
        s.emit("shapes", "forces", "instruments")
        for name, side in (("right", 1), ("left", -1)):
            turn = f" turn 1 0 0 {turn_of(self.mesh)!r}" if self.mesh == "turned" else ""
            s.line(f"move {name} {side * 6.21!r} 0 0{turn} over 0.2")
        s.steps(0.4, 0.1)
        self.limit_estimate = 2 * self.mu * 2e4 * 100 * 0.058 / b.weight
        for k in range(65):
            s.gravity(size=self.limit_estimate * (k + 1) / 50)
            s.steps(1 / 60, 1 / 60)

    def judge(self, s, frames):
        held, largest, slip = frames[3], 0.0, None
        m = s.models["block"].weight
        last = m and s.models["block"].centre(held.shapes["block"])
        for k, f in enumerate(frames[4:]):
            here = s.models["block"].centre(f.shapes["block"])
            speed = -(here[2] - last[2]) * 60
            last = here
            n = [abs(f.instruments[name][1][0]) for name in ("left", "right")]
            t = [abs(f.instruments[name][1][2]) for name in ("left", "right")]
            if min(n) <= 0:
                break
            largest = max(largest, *(a / b for a, b in zip(t, n)))
            if slip is None and speed > 10:
                slip = self.limit_estimate * (k + 1) / 50 * m / (2 * self.mu * mean(n))
                break
        yield near("largest tangential over normal force", largest, self.mu, 0.01 * self.mu)
        yield near("weight over 2 mu N where it slips", slip if slip else math.nan, 1, 0.05)


class Uterus(Case):
    """Uterine tissue on a plate, a sphere of 6 mm pressed 1.26 mm deep into it, strains of tens of per cent: it finds a shape.

    Measured: 0.01231 N; the Young's modulus of 2.58 kPa was fitted to that by a linear law.
    """

    name, source = "uterus", "cduartec/febio, specimen SMHF5B"
    limit = 120.0

    def build(self, s):
        if not (Case.data / "uterus_indentation").exists():
            raise Skipped("no uterus_indentation")
        n = {"aligned": (16, 14, 4), "turned": (19, 17, 5), "coarse": (10, 8, 2)}[self.mesh]
        s.solid("tissue", box(n, (19.2, 16.5, 4.2), (-9.6, -8.25, 0)), 2580, 0.45, words="method=ffe law=neo-hookean",
                fix=[("z<0.001", "z"), ("near:-9.6,-8.25,0,0.1", "xyz"), ("near:9.6,-8.25,0,0.1", "yz")])
        s.line("instrument ball sphere 3 0.1 0.2 7.25")
        self.tools = [("ball", 3.0, (0, 0, 0))]
        s.emit("shapes", "forces", "instruments")
        for k in range(1, 8):
            s.line(f"move ball 0.1 0.2 {7.2 - 0.18 * k!r}")
            s.line("step 0.1")

    def judge(self, s, frames):
        force = frames[-1].instruments["ball"][1][2]
        if self.order == 2 and self.mesh != "coarse":
            yield near("force over the measured one", force / 12310, 1, 0.25)
        else:  # elements of linear displacements, or as large as what is touched, are too stiff: that a shape is found counts
            yield near("force over the measured one", force / 12310, 1.75, 0.75)


class Memory(Case):
    """A cube of 6,156 nodes under a flat plate with `--max-memory 150M`: no more memory than that, and the force of a patch."""

    name, source = "memory", "uniaxial stress"
    limit = 120.0

    def build(self, s):
        s.solid("cube", box((17, 17, 18), (20, 20, 20), (0, 0, 0)), 2e4, 0.3, words="method=ffe",
                fix=[("z<0.001", "z"), ("near:0,0,0,0.1", "xyz"), ("near:20,0,0,0.1", "yz")])
        s.mesh_instrument("plate", plate((50, 50, 10)), (10, 10, 25.51))
        s.options = ["--max-memory", "150M"]
        s.emit("surfaces", "forces", "instruments")
        s.line("move plate 10 10 25.3")
        s.line("step 0.1")

    def judge(self, s, frames):
        top = [n for n, p in enumerate(s.models["cube"].rest) if p[2] > 19.999]
        depth = 20 - mean(frames[-1].shapes["cube"][n][2] for n in top)
        yield near("force over E A d / h", frames[-1].instruments["plate"][1][2] / (2e4 * 400 * depth / 20), 1, 0.005)
        yield at_most("memory", s.memory, 150, "MiB")
        yield at_most("processor time", s.cpu, 3.0, "s")


class Poses(Case):
    """A thousand random instruments pressed into organs and moved along, judged by `instruments.py` from answers alone."""

    name, source = "poses", "tests/validate/instruments.py"
    limit = 3600.0
    count = 1000

    def build(self, s):
        pass

    def execute(self, s, limit):
        script = pathlib.Path(__file__).resolve().parent / "instruments.py"
        environment = dict(os.environ, PATH=f"{s.programs}:{os.environ['PATH']}")
        try:
            end = subprocess.run([sys.executable, str(script), "--count", str(self.count), "--data", str(Case.data)], env=environment, cwd=s.folder,
                                 capture_output=True, text=True, timeout=limit)
        except subprocess.TimeoutExpired:
            raise Failure(f"not done within {limit:g} s") from None
        if end.returncode:
            raise Failure(f"status {end.returncode}: {(end.stdout + end.stderr).strip().splitlines()[-1]}")
        return [shown("cases", float(self.count))]


# --- The table of cases -------------------------------------------------------------------------------------------------


def variations():
    return [(mesh, order, dt) for mesh in MESHES for order in ORDERS for dt in DTS]


def cases():
    """Every case, quick ones marked; scenes with few parameters in all variations, sweeps in turns through them."""
    out = []
    every = variations()

    def sweep(kind, parameters, quick=()):
        """Each set of parameters in one variation, these taken in turns."""
        for k, p in enumerate(parameters):
            mesh, order, dt = every[(7 * k) % len(every)]
            out.append(kind(mesh, order, dt, quick=k in quick, **p))

    def full(kind, quick=(), **p):
        for k, (mesh, order, dt) in enumerate(every):
            out.append(kind(mesh, order, dt, quick=k in quick, **p))

    # quick: 1 is aligned, linear, 1/200 s; 7 turned, linear, 1/200 s; 10 turned, quadratic, 1/200 s; 13 coarse, linear, 1/200 s
    full(Slope, quick=(1, 7, 13), angle=10.0, mu=0.0)
    full(Slope, quick=(1,), angle=18.0, mu=0.3)
    full(Slope, quick=(7,), angle=25.0, mu=0.3)
    full(Slope, quick=(13,), angle=10.0, mu=0.3)
    full(Slope, angle=0.0, mu=0.3, quick=(6,))
    sweep(Slope, [dict(angle=a, mu=mu) for mu in (0.0, 0.3, 0.6, 1.0) for a in (0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)
                  if (a, mu) not in ((10.0, 0.0), (25.0, 0.3), (10.0, 0.3), (0.0, 0.3))])
    sweep(Slope, [dict(angle=22.0, mu=0.3), dict(angle=15.0, mu=0.3)])
    full(Rest, quick=(6,))
    full(Stack, quick=(1,))
    full(Drop, quick=(1,))
    full(Drop, height=2.0, mu=0.2)
    full(Balls, quick=(1,))
    full(Balls, offset=8.0, mu=0.0)
    sweep(Balls, [dict(offset=8.0, mu=0.3), dict(offset=0.0, mu=0.3), dict(offset=12.0, mu=0.6)])
    for mesh in MESHES:  # steps that resolve the wave
        for order in ORDERS:
            out += [Bar(mesh, order, dt, quick=(mesh, order, dt) == ("aligned", 1, 1 / 1200)) for dt in (1 / 600, 1 / 1200, 1 / 4800)]
    full(Topple, beyond=-1.0, quick=(13,))
    full(Topple, beyond=1.0, quick=(13,))
    full(Pendulum, quick=(1,))
    full(Brake, quick=(1,))
    full(Belt, quick=(7,))
    full(Push, quick=(1,))
    full(Ladder, angle=38.0, quick=(1,))
    full(Ladder, angle=44.0, quick=(7,))
    full(Groove, quick=(1,))
    full(Hole, quick=(1,))
    full(Hole, angle=35.0, mu=0.2)
    full(House)
    full(Arch)
    full(Wedge, alpha=14.0, quick=(1,))
    full(Wedge, alpha=20.0, quick=(1,))
    full(Grasp, quick=(0,))
    full(Capstan)
    for mesh, order, dt in every:
        if order == 1:
            out += [Capstan(mesh, 1, dt, kind="net")] + [kind(mesh, 1, dt) for kind in (NetUnderBall, Sheet, FoldedTube)]
    full(Flaps)
    full(Wound, quick=(1,))
    for mesh in MESHES:  # statics: steps of time say nothing
        for order in ORDERS:
            out += [kind(mesh, order, 1 / 200) for kind in (Hertz, Mindlin, Uterus)]
            out.append(Plate(mesh, order, 1 / 200, quick=True))
    out += [GallBladder("aligned", 2, dt) for dt in DTS]
    out.append(Memory("aligned", 1, 1 / 200))
    out.append(Poses("aligned", 1, 1 / 60))
    return out


# --- Running, and the page ----------------------------------------------------------------------------------------------


class Outcome:
    """What a case came to. Checks, or why there are none."""

    def __init__(self, checks, failure=None, skipped=None, cpu=0.0, memory=0.0):
        self.case, self.checks, self.failure, self.skipped, self.cpu, self.memory = None, checks, failure, skipped, cpu, memory


class Skipped(Exception):
    """A case that lacks what it needs."""


def folder_of(case):
    return re.sub(r"[^A-Za-z0-9.=-]+", "_", str(case))


def perform(case, programs, folder, limit):
    s = Scene(folder, programs, case.order, case.dt)
    try:
        case.build(s)
    except Skipped as reason:
        return Outcome([], skipped=str(reason))
    except (Failure, subprocess.TimeoutExpired) as error:
        return Outcome([], failure=f"not built: {error}")
    try:
        checks = case.execute(s, limit or case.limit)
        return Outcome(checks, cpu=s.cpu, memory=s.memory)
    except Failure as error:
        return Outcome([], failure=str(error), cpu=s.cpu, memory=s.memory)
    except (KeyError, IndexError, ZeroDivisionError, ValueError, OverflowError) as error:
        return Outcome([], failure=f"answers lack what is judged: {type(error).__name__} {error}", cpu=s.cpu)


def figure(x):
    return "" if math.isnan(x) else f"{x:.5g}"


def bound_of(c):
    return "" if c.kind == "shown" else f"± {figure(c.bound)}" if c.kind == "near" else ("≤ " if c.kind == "at most" else "≥ ") + figure(c.bound)


def rows_of(outcome):
    """(what, measured, theory, bound, verdict) of an outcome."""
    if outcome.skipped:
        return [("", "", "", "", f"skipped: {outcome.skipped}")]
    if outcome.failure:
        return [("the run", outcome.failure, "", "", "**failed**")]
    return [(c.what, figure(c.measured) + (f" {c.unit}" if c.unit else ""), figure(c.theory), bound_of(c),
             "shown" if c.kind == "shown" else "passed" if c.passed else "**failed**") for c in outcome.checks]


def write_page(page, outcomes, programs):
    page.mkdir(parents=True, exist_ok=True)
    version = subprocess.run([str(programs / "ffe-run"), "--version"], capture_output=True, text=True).stdout.splitlines()
    out = ["# Contact against textbook scenes", "",
           f"By `make validate S=textbook` with {version[0] if version else 'ffe-run'}. Each scene is run with three meshes, two orders of elements and "
           "three time steps; a row is a check of one run. Bounds are of |measured − theory|, or limits. The last rows of each run hold in every "
           "scene: forces sum to zero, no pull, no intersection.", "", "| scene | runs | passed | failed checks | processor time, s |", "|---|---|---|---|---|"]
    kinds = {}
    for o in outcomes:
        kinds.setdefault(o.case.name, []).append(o)
    for name, of in kinds.items():
        good = sum(not o.skipped and not o.failure and all(c.passed for c in o.checks) for o in of)
        bad = sum((1 if o.failure else sum(not c.passed for c in o.checks)) for o in of)
        out.append(f"| [{name}](#{name.replace(' ', '-')}) | {len(of)} | {good} | {bad} | {sum(o.cpu for o in of):.1f} |")
    for name, of in kinds.items():
        case = of[0].case
        out += ["", f"## {name}", "", " ".join((type(case).__doc__ or "").split()), "", f"Source: {case.source}.", ""]
        out += plots(page, name, of)
        out += ["| case | mesh | order | step | check | measured | theory | bound | verdict |", "|---|---|---|---|---|---|---|---|---|"]
        for o in of:
            own = ", ".join(f"{k} {v:g}" if isinstance(v, (int, float)) else f"{k} {v}" for k, v in o.case.parameters.items())
            head = f"| {own} | {o.case.mesh} | {o.case.order} | 1/{round(1 / o.case.dt)} |"
            out += [f"{head} {' | '.join(row)} |" for row in rows_of(o)]
    (page / "README.md").write_text("\n".join(out) + "\n")


def plots(page, name, outcomes):
    """Measured over theory, against the time step, of the first check with a theory; one line for each mesh and order."""
    groups = {}
    for o in outcomes:
        for c in o.checks:
            if c.kind == "near":
                # The error over its bound: below 1 is passed.
                groups.setdefault(c.what, {}).setdefault(f"{o.case.mesh}, order {o.case.order}", []).append((o.case.dt, max(1e-6, abs(c.measured - c.theory) / c.bound)))
    out = []
    for k, (what, lines) in enumerate(list(groups.items())[:3]):
        data = [(line, sorted(points)) for line, points in sorted(lines.items())]
        try:
            text = plot.curves(f"{name}: {what}", "time step, s", "error over its bound", data, level=("bound", 1.0))
        except ValueError:
            continue
        file = f"{re.sub('[^a-z0-9]+', '-', name)}-{k + 1}.svg"
        (page / file).write_text(text)
        out += [f"![{name}: {what}]({file})", ""]
    return out


def theory_of(case):
    return getattr(case, "expected", lambda: "")()


def export(case, programs, folder):
    """A case as input to be run by hand: models, scene, and its theory in a README."""
    s = Scene(folder, programs, case.order, case.dt)
    case.build(s)
    s.write()
    (folder / "scene.scene").write_text(f"# {case}\n# theory: {theory_of(case)}\n" + "\n".join(s.lines) + "\n")
    for leftover in list(folder.glob("*.mesh")) + list(folder.glob("*.obj")):
        leftover.unlink()
    (folder / "README").write_text(f"{case}\n{' '.join((type(case).__doc__ or '').split())}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--build", default="build/release", help="folder of the programs")
    parser.add_argument("--page", help="folder for the page; without it only a table of what failed is printed")
    parser.add_argument("--quick", action="store_true", help="the subset for continuous integration, at most a minute of processor time")
    parser.add_argument("--only", default="", help="scenes by name, or parts of what --list prints, with commas")
    parser.add_argument("-j", type=int, default=1, help="runs at a time")
    parser.add_argument("--limit", type=float, default=0, help="seconds for a run, 0 for each scene's own")
    parser.add_argument("--keep", help="folder for models, scenes and answers")
    parser.add_argument("--data", default="../shared/data", help="folder of real organs; scenes that need them are skipped without")
    parser.add_argument("--list", action="store_true", help="print the cases")
    parser.add_argument("--export", help="write models and scenes to a folder instead of running them")
    parser.add_argument("--verbose", "-v", action="store_true", help="print every check")
    options = parser.parse_args()

    Case.data = pathlib.Path(options.data).resolve()
    chosen = [c for c in cases() if c.quick or not options.quick]
    if options.only:
        words = [w.strip() for w in options.only.split(",")]
        exact = {c.name for c in chosen} | set(map(str, chosen))
        chosen = [c for c in chosen if any(w in (c.name, str(c)) if w in exact else w in str(c) for w in words)]
    if not chosen:
        sys.exit(f"textbook.py: no scene is called '{options.only}'; see --list")
    if options.list:
        print("\n".join(map(str, chosen)))
        return 0
    programs = pathlib.Path(options.build).resolve()
    if options.export:
        for case in chosen:
            export(case, programs, pathlib.Path(options.export) / folder_of(case))
        return 0

    work = pathlib.Path(options.keep) if options.keep else pathlib.Path(tempfile.mkdtemp(prefix="contact-"))
    outcomes = []
    try:
        with concurrent.futures.ProcessPoolExecutor(options.j) as pool:
            jobs = [pool.submit(perform, case, programs, work / folder_of(case), options.limit) for case in chosen]
            for case, job in zip(chosen, jobs):
                o = job.result()
                o.case = case
                outcomes.append(o)
                bad = bool(o.failure) or not all(c.passed for c in o.checks)
                verdict = "skipped" if o.skipped else "FAILED" if bad else "passed"
                print(f"{verdict:8}{case} ({o.cpu:.1f} s)", flush=True)
                for row in rows_of(o):
                    if options.verbose or "failed" in row[-1] or "skipped" in row[-1]:
                        print("        " + "; ".join(w for w in (row[0], row[1], f"theory {row[2]}" if row[2] else "", f"bound {row[3]}" if row[3] else "",
                                                                 row[4].replace("*", "")) if w), flush=True)
                if not options.keep:
                    shutil.rmtree(work / folder_of(case), ignore_errors=True)
    finally:
        if not options.keep:
            shutil.rmtree(work, ignore_errors=True)
    if options.page:
        write_page(pathlib.Path(options.page), outcomes, programs)
        print(f"The page is {os.path.join(options.page, 'README.md')}")
    skipped = sum(bool(o.skipped) for o in outcomes)
    failed = sum(bool(o.failure) or not all(c.passed for c in o.checks) for o in outcomes)
    print(f"{sum(o.cpu for o in outcomes):.1f} s of processor time")
    print(f"{len(outcomes) - failed - skipped} passed, {failed} failed, {skipped} skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

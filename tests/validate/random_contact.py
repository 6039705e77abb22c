#!/usr/bin/env python3
"""Random scenes with contact, and what must hold for any of them.

Two to six bodies (solids of both orders and nets, by both methods), instruments, friction from 0 to 10, cuts and tears. Each
scene is served with one thread and recorded; its record is run again with two. Counted are

  unsolved      scenes with a step that was written although a last iteration changed its friction by over 1/1000
  intersecting  answers with surfaces that intersect, by `ipctk` where it is installed, else by exact signs
  differing     records whose answers with two threads are not the same bytes
  slow          scenes of over 20 s of processor time
  ended         runs that ended before the scene did
  failed        steps that failed and were rolled back: told, and no mistake

Any but the last fails. A scene is a function of --seed and its number: --number K runs that one alone.
"""

import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from scene_runs import Failure, Scene, add, ball, box, frames_of, intersect, mapped, plate, sheet, total, tube, turned, wait, words_of

SLOW, LONG = 20, 90  # s of processor time: counted as slow; ended
SLOT = 30.0  # mm: bodies start in cells of this size, and do not reach out of them
COUNTS = ("unsolved", "intersecting", "differing", "slow", "ended", "failed", "refused")


def moved(mesh, r, middle):
    """Turned at random about the origin, then put to `middle`."""
    axis, angle = tuple(r.gauss(0, 1) for _ in range(3)), r.uniform(0, 180)
    turn = lambda p: add(middle, turned(p, axis, angle))
    return ([turn(p) for p in mesh[0]], mesh[1])


class RandomScene:
    """Lines of a scene of `count` steps, and its models."""

    def __init__(self, folder, programs, seed, number):
        r = self.r = random.Random(f"{seed}/{number}")
        self.s = Scene(folder, programs, r.choice((1, 1, 2)), r.choice((1 / 60, 1 / 200, 1 / 600)))
        self.bodies = []  # (name, kind, moves)
        self.tools = []
        count = r.randint(2, 6)
        slots = [(i, j, k) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
        r.shuffle(slots)
        slots.sort(key=lambda q: q[2])  # the lower ones first
        self.still = r.random() < 0.15  # all bodies elastostatic and held
        # Solids that may touch move by one law.
        self.law = r.choice(("", "", "", "law=neo-hookean", "damping=0.2@10"))
        for k in range(count):
            self.add_body(f"o{k}", tuple(SLOT * (q - 0.5) for q in slots[k]))
        if r.random() < 0.6 and not self.still:
            n = r.randint(2, 6)
            self.s.solid("floor", box((n, n, 1), (80, 80, 5), (-40, -40, -SLOT - 5)), 1e5, fix=f"z<{-SLOT - 4.99!r}",
                         words=self.law)
            self.bodies.append(("floor", "solid", False))
        self.touch()
        if not self.still:
            self.s.gravity(r.choice((0, 0, r.uniform(0, 40))), size=r.choice((9810, 9810, 3000, 0)))
        for k in range(r.choice((0, 1, 1, 2))):
            self.add_tool(f"t{k}")
        self.s.emit("shapes", "forces", "instruments")
        for _ in range(r.randint(8, 20)):
            for _ in range(r.choice((0, 0, 1, 1, 2))):
                self.act()
            self.s.line(f"step {r.choice((0.01, 0.02, 0.02, 0.03, 0.05))!r}")

    def add_body(self, name, middle):
        r, size = self.r, SLOT * 0.5
        # A net moves by the default law alone.
        kind = r.choice(("block", "block", "ball", "bar", "wedge") + (() if self.law else ("sheet", "tube", "shell")))
        held = self.still or r.random() < 0.25
        young = 10 ** r.uniform(3.5, 5.5)

        def lowest(mesh):
            """Selects a fifth of the points, at least four, of a body that is held."""
            heights = sorted(p[2] for p in mesh[0])
            return f"z<{heights[max(4, len(heights) // 5)] + 1e-6!r}" if held else None

        if kind in ("sheet", "tube", "shell"):
            n = r.randint(4, 9)
            if kind == "sheet":
                mesh = sheet(n, n, lambda i, j: (size * (i / n - 0.5) * 1.2, size * (j / n - 0.5) * 1.2, 0))
            elif kind == "tube":
                mesh = tube(r.randint(6, 12), n, 0.3 * size, size, (-0.5 * size, 0, 0))
            else:
                points, cells = ball(r.randint(2, 3), 0.5 * size, (0, 0, 0))
                mesh = outside(points, cells)
            mesh = moved(mesh, r, middle)
            words = "method=ffe" if self.still else "integration=implicit"
            self.s.net(name, mesh, young=young, thickness=r.uniform(0.2, 1), drag=r.choice((0, 1, 5)), fix=lowest(mesh), words=words,
                       centrals=4 if kind == "shell" or self.still else 0)
            self.bodies.append((name, "net", not self.still))
            return
        if kind == "block":
            n = tuple(r.randint(1, 3) for _ in range(3))
            mesh = box(n, (size, 0.8 * size, 0.6 * size), (-size / 2, -0.4 * size, -0.3 * size))
        elif kind == "bar":
            mesh = box((r.randint(2, 5), 1, 1), (1.4 * size, 0.3 * size, 0.3 * size), (-0.7 * size, -0.15 * size, -0.15 * size))
        elif kind == "wedge":
            mesh = box((2, 2, 2), (size, size, size), (-size / 2, -size / 2, -size / 2))
            mesh = mapped(mesh, lambda p: (p[0] * (0.65 + 0.6 * p[2] / size), p[1], 0.8 * p[2]))
        else:
            mesh = ball(r.randint(2, 3), 0.5 * size, (0, 0, 0), axes=(1, r.uniform(0.5, 1), 1))
        words = "method=ffe" if self.still else self.law
        mesh = moved(mesh, r, middle)
        self.s.solid(name, mesh, young, r.choice((0.0, 0.3, 0.45)), drag=r.choice((0, 0, 2)), fix=lowest(mesh), words=words)
        self.bodies.append((name, "solid", not self.still))

    def friction(self):
        r = self.r
        return r.choice((0.0, r.uniform(0.05, 1), 10 ** r.uniform(-2, 1)))

    def touch(self):
        names = [n for n, *_ in self.bodies]
        for k, a in enumerate(names):
            for b in names[:k]:
                if self.r.random() < 0.9:
                    self.s.contact(b, a, self.friction())
            if a != "floor" and self.r.random() < 0.3:
                self.s.contact(a, "self", self.friction())

    def add_tool(self, name):
        """Far from where bodies start; it moves in later."""
        r, mu = self.r, self.friction()
        start = (r.choice((-1, 1)) * 2.2 * SLOT, r.uniform(-20, 20), r.uniform(-20, 20))
        friction = f" friction {mu!r}" if mu else ""
        kind = r.choice(("sphere", "capsule", "mesh"))
        if kind == "sphere":
            self.s.line(f"instrument {name} sphere {r.uniform(3, 8)!r} {words_of(start)}{friction}")
        elif kind == "capsule":
            axis = tuple(r.uniform(-15, 15) for _ in range(3))
            self.s.line(f"instrument {name} capsule {r.uniform(1.5, 4)!r} {words_of(start, add(start, axis))}{friction}")
        else:
            self.s.mesh_instrument(name, plate(tuple(r.uniform(3, 12) for _ in range(3))), start, friction.strip())
        self.tools.append(name)

    def act(self):
        r = self.r
        name, kind, _ = r.choice([b for b in self.bodies if b[0] != "floor"])
        model = self.s.models[name]
        node = r.randrange(len(model.rest))
        at = model.rest[node]
        what = r.choice(("force", "force", "displace", "release", "tool", "tool", "tool", "cut", "tear", "gravity"))
        vector = lambda size: words_of(tuple(r.uniform(-size, size) for _ in range(3)))
        if what == "force":
            self.s.line(f"force {name} near:{','.join(map(repr, at))},1 {vector(10 ** r.uniform(3, 5))}")
        elif what == "displace":
            self.s.line(f"displace {name} near:{','.join(map(repr, at))},1 {vector(6)} over {r.uniform(0.02, 0.2)!r}")
        elif what == "release":
            self.s.line(f"release {name} all")
        elif what == "tool" and self.tools:
            place = tuple(r.uniform(-0.9, 0.9) * SLOT for _ in range(3))
            self.s.line(f"move {r.choice(self.tools)} {words_of(place)} over {r.uniform(0.1, 0.5)!r}")
        elif what == "cut":
            middle = model.centre()
            self.s.line(f"cut {name} plane {words_of(middle)} {vector(1)}")
        elif what == "tear":
            self.s.line(f"tear {name} {r.uniform(0.1, 0.8)!r}" if kind == "net" else f"tear {name} strain={r.uniform(0.1, 0.8)!r}")
        elif what == "gravity" and not self.still:
            self.s.line(f"gravity {vector(9810)}")


def outside(points, cells):
    """Surface of tetrahedra."""
    faces = {}
    for a, b, c, d in cells:
        for f in ((a, c, b), (a, b, d), (a, d, c), (b, c, d)):
            key = tuple(sorted(f))
            faces[key] = None if key in faces else f
    kept = [f for f in faces.values() if f]
    used = sorted({n for f in kept for n in f})
    number = {n: k for k, n in enumerate(used)}
    return [points[n] for n in used], [tuple(number[n] for n in f) for f in kept]


def carry_out(programs, folder, options, source, out):
    """Status, processor time, and the statistics of a run of `source`."""
    stats = folder / f"{out}.json"
    command = [str(programs / "ffe-run"), f"--stats={stats}", *options]
    bound = lambda: resource.setrlimit(resource.RLIMIT_CPU, (LONG, LONG + 5))
    with open(source) as scene, open(folder / out, "w") as answers, open(folder / f"{out}.err", "w") as err:
        words = ["--serve"] if "--serve" in options else [source.name]
        process = subprocess.Popen(command if words == ["--serve"] else command + words, cwd=folder, stdin=scene, stdout=answers, stderr=err,
                                   start_new_session=True, preexec_fn=bound)
        _, status, usage = wait(process, 10 * LONG)
    try:
        found = json.loads(stats.read_text())
    except (OSError, ValueError):
        found = {}
    return status, usage.ru_utime + usage.ru_stime if usage else LONG, found


def perform(programs, folder, seed, number):
    """Counts of one scene, and what was wrong."""
    found, told = dict.fromkeys(COUNTS, 0), []
    try:
        scene = RandomScene(folder, programs, seed, number)
    except (Failure, subprocess.TimeoutExpired) as error:
        return number, found | {"ended": 1}, [f"not built: {error}"], 0.0
    s = scene.s
    s.write()
    status, cpu, stats = carry_out(programs, folder, ["-j1", "--serve", "--record", "record.scene"], folder / "scene.scene", "answers.txt")
    lines = (folder / "answers.txt").read_text().splitlines()
    errors = [line for line in lines if line.startswith("error ")]
    refused = {s.lines[int(e.split()[1].rstrip(":")) - 1] for e in errors}
    pairs = [(w[1], w[2]) for w in map(str.split, s.lines) if w[0] == "contact" and " ".join(w) not in refused]
    failed = [e for e in errors if s.lines[int(e.split()[1].rstrip(":")) - 1].startswith("step")]
    found["failed"], found["refused"] = len(failed), len(errors) - len(failed)
    if status not in (0, 1):
        found["ended"] = 1
        told.append(f"status {status} after {cpu:.0f} s")
    if cpu > SLOW:
        found["slow"] = 1
        told.append(f"{cpu:.1f} s of processor time")
    if not (residual := stats.get("contact_friction_residual", 0)) <= 1e-3:
        found["unsolved"] = 1
        told.append(f"friction changed by {residual:.2g}")
    plain = [line for line in lines if not line.startswith("error ")]
    changed = {}
    for frame in frames_of(plain):
        changed.update(frame.triangles)
        if pairs and intersect(s.models, frame, changed, pairs):
            found["intersecting"] += 1
            if found["intersecting"] == 1:
                told.append(f"surfaces intersect at {frame.time:g} s")
    if (folder / "record.scene").exists() and status in (0, 1):
        again, _, other = carry_out(programs, folder, ["-j2"], folder / "record.scene", "again.txt")
        same = (folder / "again.txt").read_text().splitlines() == plain and other.get("digest") == stats.get("digest")
        if again != 0 or not same:
            found["differing"] = 1
            served, _, _ = carry_out(programs, folder, ["-j2", "--serve"], folder / "scene.scene", "threads.txt")
            threads = served in (0, 1) and (folder / "threads.txt").read_text().splitlines() == lines
            told.append(f"the record ends with {again}" if again else "the record " + ("answers otherwise" if threads else "and two threads answer otherwise"))
    return number, found, told, cpu


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build/release", help="folder of the programs")
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, help="this scene alone")
    parser.add_argument("-j", type=int, default=1, help="scenes at a time")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the scenes that break something; with --number for that one")
    options = parser.parse_args()
    programs = pathlib.Path(options.build).resolve()
    numbers = [options.number] if options.number is not None else range(options.first, options.first + options.count)
    sums, broken, time = dict.fromkeys(COUNTS, 0), 0, 0.0
    with tempfile.TemporaryDirectory() as temporary, concurrent.futures.ProcessPoolExecutor(options.j) as pool:
        work = pathlib.Path(temporary)
        jobs = {pool.submit(perform, programs, work / str(k), options.seed, k): k for k in numbers}
        for job in concurrent.futures.as_completed(jobs):
            number, found, told, cpu = job.result()
            time += cpu
            for key in COUNTS:
                sums[key] += found[key]
            folder = work / str(number)
            if told:
                broken += 1
                print(f"scene {number}: {'; '.join(told)}", flush=True)
            if options.keep and (told or options.number is not None):
                shutil.copytree(folder, options.keep / f"{options.seed}-{number}", dirs_exist_ok=True)
            shutil.rmtree(folder, ignore_errors=True)
    print(f"{len(jobs)} scenes, {time:.0f} s of processor time: " + ", ".join(f"{sums[k]} {k}" for k in COUNTS))
    print(f"{len(jobs) - broken} passed, {broken} failed, 0 skipped")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())

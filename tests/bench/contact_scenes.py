#!/usr/bin/env python3
"""Time of scenes with contact: a step's median and processor time a second of the scene.

  contact_scenes.py [NAME ...] [-j N]

  liver         13,182 linear tetrahedra, grasped by two jaws and pulled
  gallbladder   1,536 quadratic tetrahedra between two capsules, drawn while it slips
  net           21 x 21 nodes, hung by its corners, under a solid ball
  pressed       two solids of 13,182 linear tetrahedra, pressed until 200 nodes touch

Writes CSV: stage, program, nodes, contacts (nodes with a contact force, mean and most), steps, times of a step in ms
(median, 90 %, slowest) and processor time in s over the scene's time in s. Programs are those of $PATH.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "validate"))

from scene_runs import Scene, ball, grid, norm, plate, scale, sheet, words_of


def ellipsoid(counts, axes, centre=(0, 0, 0)):
    """A grid of cells pushed out to an ellipsoid."""

    def place(i, j, k):
        p = tuple(2.0 * n / c - 1 for n, c in zip((i, j, k), counts))
        length = norm(p)
        p = scale(max(map(abs, p)) / length if length else 0, p)
        return tuple(c + a * x for c, a, x in zip(centre, axes, p))

    return grid(counts, place)


def grasp(s, steps, start, close, pull):
    """Two instruments close along z by `close` in the first half of the steps, and go by `pull` along x in the second."""
    s.emit("forces", "instruments")
    for k in range(steps):
        t = 2 * (k + 1) / steps
        for name, side in (("lower", -1), ("upper", 1)):
            at = (start[0] + pull * max(0, t - 1), start[1], side * (start[2] - close * min(1, t)))
            s.line(f"move {name} {words_of(at)} over {1 / 60!r}")
        s.line(f"step {1 / 60!r}")
    return s, steps / 60


def liver(folder, programs):
    s = Scene(folder, programs, 1, 1 / 60)
    s.solid("liver", ellipsoid((13, 13, 13), (70, 50, 35)), 5000, 0.45, fix="x<-60", words="damping=0.2@10")
    for name, z in (("lower", -40), ("upper", 40)):
        s.mesh_instrument(name, plate((24, 40, 4)), (40, 0, z), "friction 0.8")
    return grasp(s, 60, (40, 0, 40), 10, 15)


def gallbladder(folder, programs):
    s = Scene(folder, programs, 2, 1 / 200)
    s.solid("gallbladder", ellipsoid((8, 8, 4), (25, 12, 10)), 20000, 0.4, fix="x<-20", words="damping=0.2@10")
    for name, z in (("lower", -12.5), ("upper", 12.5)):
        s.line(f"instrument {name} capsule {words_of(2, (8, -8, z), (8, 8, z))} friction 0.6")
    return grasp(s, 48, (8, -8, 12.5), 3, 12)


def net(folder, programs):
    s = Scene(folder, programs, 1, 1 / 200)
    s.net("net", sheet(20, 20, lambda i, j: (3 * i - 30, 3 * j - 30, 0)), young=5e4, fix=[(f"{a}{c}29", "xyz") for a in "xy" for c in ("<-", ">")])
    s.solid("ball", ball(4, 10, (0.4, 0.3, 12)), 20000, 0.4)
    s.contact("net", "ball", 0.3)
    s.gravity()
    s.emit("forces")
    for _ in range(60):
        s.line(f"step {1 / 60!r}")
    return s, 1


def pressed(folder, programs):
    s = Scene(folder, programs, 1, 1 / 60)
    s.solid("lower", ellipsoid((13, 13, 13), (50, 50, 30)), 5000, 0.4, fix="z<-20", words="damping=0.2@10")
    upper = s.solid("upper", ellipsoid((13, 13, 13), (50, 50, 30), (2, 1, 61)), 5000, 0.4, words="damping=0.2@10")
    top = ",".join(map(str, upper.where(lambda p: p[2] > 85)))
    s.contact("lower", "upper", 0.2)
    s.emit("forces")
    for k in range(60):
        s.line(f"displace upper {top} 0 0 {-12 * (k + 1) / 60!r} over {1 / 60!r}")
        s.line(f"step {1 / 60!r}")
    return s, 1


SCENES = {"liver": liver, "gallbladder": gallbladder, "net": net, "pressed": pressed}


def served(s, threads, limit):
    """Times of steps, contacts of each, and processor time of all of the run and of what comes before the first step."""
    s.write()
    with open(s.folder / "scene.scene") as source, open(s.folder / "errors.txt", "w") as errors:
        process = subprocess.Popen([str(s.programs / "ffe-run"), f"-j{threads}", "--serve"], cwd=s.folder, stdin=source,
                                   stdout=subprocess.PIPE, stderr=errors, text=True)
        times, contacts, last, begun, touching = [], [], None, 0.0, 0
        clock = lambda: sum(map(float, pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13])) / os.sysconf("SC_CLK_TCK")
        for line in process.stdout:
            words = line.split()
            if not words:
                continue
            if words[0] == "forces":
                touching += int(words[2])
            elif words[0] == "done":
                now = time.monotonic()
                if last is None:
                    begun = clock()
                else:
                    times.append(1000 * (now - last))
                contacts.append(touching)
                last, touching = now, 0
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return times, contacts, usage.ru_utime + usage.ru_stime - begun, process.returncode


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("-j", type=int, default=1)
    parser.add_argument("--keep")
    arguments = parser.parse_args()
    programs = pathlib.Path(next((p for p in os.environ["PATH"].split(":") if os.access(os.path.join(p, "ffe-run"), os.X_OK)), "."))
    print("stage,program,nodes,contacts,most contacts,steps,median ms,90 % ms,slowest ms,s per s")
    failed = False
    for name in arguments.names or SCENES:
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(arguments.keep or temporary) / name
            s, duration = SCENES[name](folder, programs)
            times, contacts, cpu, status = served(s, arguments.j, 600)
            errors = (s.folder / "errors.txt").read_text().splitlines()
            if status or len(times) < 2:
                print(f"contact_scenes: {name}: status {status}, {errors[-1] if errors else ''}", file=sys.stderr)
                failed = True
                continue
            used = [c for c in contacts if c]
            order = sorted(times)
            nodes = sum(len(m.rest) for m in s.models.values())
            print(f"contact scene,{name},{nodes},{statistics.mean(used or [0]):.0f},{max(contacts)},{len(times) + 1},"
                  f"{statistics.median(order):.2f},{order[int(0.9 * len(order))]:.2f},{order[-1]:.2f},{cpu / duration:.2f}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Two builds of the programs beside each other: time, memory and results.

  two_builds.py BEFORE AFTER [--data FOLDER] [--only WORD] [--repeat N] [--work FOLDER]

BEFORE and AFTER are folders of programs, as build/release of two commits is. Each case runs in turns, once with each of
them, N times (7) after a first one that counts for nothing, on one thread and on two. Cases are the steps of a chain on
an organ, each on the inputs that AFTER makes of it, which stay in FOLDER.

Writes CSV to standard output: case, threads, median time of both in ms, theirs over each other, the processor's time of
both in ms, the most memory of both in MB, and the result: "equal" bytes, else the largest difference over the largest
number of what both wrote, or "differs" where that is no text of numbers. Real organs in FOLDER (../shared/data).
"""

import argparse
import filecmp
import os
import pathlib
import random
import re
import shutil
import statistics
import subprocess
import tempfile
import time

COUNT = 7
NAMES = ("before", "after")

SCENE_SPRINGS = """object colon colon.ela method=ela
gravity 0 0 -9810
displace colon 0,300 0 0 0
emit forces
run 0.5 every 0.1
"""


SCENE_MANY_SPRINGS = """object large large.ela method=ela
gravity 0 0 -9810
emit forces
run 0.0005 every 0.0005
"""


def forces(build):
    """A scene of 30 nodes that are displaced anew at each of 300 steps, as contacts would."""
    rng = random.Random(30)
    lines = [f"object colon colon.ela method=ffe store=colon.{build}.h5", "emit forces"]
    for _ in range(300):
        lines += [f"displace colon {300 * n} {rng.uniform(-1, 1):.3f} {rng.uniform(-1, 1):.3f} {rng.uniform(-1, 1):.3f}" for n in range(30)]
        lines.append("step 0")
    return "\n".join(lines) + "\n"


def particles(count, reach, side):
    """Lines of x y z R, at random in a box."""
    rng = random.Random(count)
    return "".join(f"{rng.random() * side:.6f} {rng.random() * side:.6f} {rng.random() * side:.6f} {reach}\n" for _ in range(count))


def prepare(builds, data, work):
    """The inputs of all cases; stores and what names them for each build, for their format has changed."""

    def make(name, command, programs=builds[1]):
        if not (work / name).exists():
            env = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}", DATA=str(data))
            subprocess.run(["/bin/bash", "-c", command], cwd=work, env=env, check=True)

    (work / "few").write_text(particles(1000, 40, 300))
    (work / "near").write_text(particles(20000, 6, 300))
    (work / "wide").write_text(particles(20000, 12, 300))
    make("band.vdb", 'voxelize --dim 660 -o band.vdb "$DATA/sofa_liver_smooth.obj"')
    make("band.ply", "mc-opt band.vdb -o band.ply")
    make("colon.ela", 'exp2ela -q "$DATA/gca90_large_intestine_20k.stl" -o colon.ela')
    make("organ.ply", 'voxelize --dim 140 "$DATA/sofa_liver_smooth.obj" | mc-opt -o organ.ply')
    make("million.ply", 'voxelize --dim 450 "$DATA/sofa_liver_smooth.obj" | mc-opt -o million.ply')
    make("large.ela", 'voxelize --dim 200 "$DATA/sofa_liver_smooth.obj" | mc-opt | exp2ela -q -o large.ela')
    (work / "springs.scene").write_text(SCENE_SPRINGS)
    (work / "many.scene").write_text(SCENE_MANY_SPRINGS)
    for build, programs in zip(NAMES, builds):
        make(f"colon.{build}.h5", f"ffe-precompute -q colon.ela -o colon.{build}.h5", programs)
        (work / f"forces.{build}.scene").write_text(forces(build))


FRAMES = "emboss-render --backend cpu -j$T $(test $B = before || echo --plain) -q --texture noise --structure noise --to rgb"

# Case, what it runs ($T threads), what of it is compared: a file, or - for what it writes.
CASES = [
    ("density, reach 6", "metaball2vol -j$T --voxel 1 near -o out.vdb", "out.vdb"),
    ("density, reach 12", "metaball2vol -j$T --voxel 1 wide -o out.vdb", "out.vdb"),
    ("density, band, reach 12", "metaball2vol -j$T --voxel 1 --band 0.5 wide -o out.vdb", "out.vdb"),
    ("density of 512 | surface", "metaball2vol -j$T --dim 512 few | mc-opt -j$T -q -o out.ply", "out.ply"),
    ("surface", "mc-opt -j$T -q --epsilon 0 band.vdb -o out.ply", "out.ply"),
    ("surface, snapped", "mc-opt -j$T -q band.vdb -o out.ply", "out.ply"),
    ("surface, snapped, statistics", "mc-opt -j$T -q band.vdb -o out.ply --stats=stats", "out.ply"),
    ("model of springs", "exp2ela -j$T -q band.ply > /dev/null", None),
    ("model of springs, its text", "exp2ela -j$T -q colon.ela -o out.ela", "out.ela"),
    ("factor", "ffe-precompute -j$T -q colon.ela -o out.h5", None),
    ("factor and columns of 256 nodes", "ffe-precompute -j$T -q --columns 0-255 colon.ela -o out.h5", None),
    ("30 contacts, 300 shapes", "ffe-run -j$T -q forces.$B.scene", "-"),
    ("springs, 0.5 s", "ffe-run -j$T -q springs.scene", "-"),
    ("springs, 0.5 ms of 98,284 nodes", "ffe-run -j$T -q many.scene", "-"),
    ("frame without OpenGL", "emboss-render --backend cpu -j$T $(test $B = before || echo --plain) -q organ.ply -o out.png", "out.png"),
    ("60 frames of 96,000 triangles", f"{FRAMES} --turn 60 organ.ply -o out.rgb", "out.rgb"),
    ("10 frames of a million triangles", f"{FRAMES} --turn 10 million.ply -o out.rgb", "out.rgb"),
    ("start: metaball2vol", "metaball2vol --version >/dev/null", None),
    ("start: mc-opt", "mc-opt --version >/dev/null", None),
    ("start: exp2ela", "exp2ela --version >/dev/null", None),
    ("start: ffe-precompute", "ffe-precompute --version >/dev/null", None),
    ("start: ffe-run", "ffe-run --version >/dev/null", None),
    ("start: emboss-render", "emboss-render --version >/dev/null", None),
]


class Run:
    """One run: its time, the processor's, memory, and what it wrote."""

    def __init__(self, programs, build, command, threads, work):
        env = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}", T=str(threads), B=build)
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as said:
            begin = time.perf_counter()
            process = subprocess.Popen(["/bin/bash", "-c", command], cwd=work, env=env, stdout=out, stderr=said)
            _, status, usage = os.wait4(process.pid, 0)
            self.time = 1e3 * (time.perf_counter() - begin)
            process.returncode = os.waitstatus_to_exitcode(status)
            if process.returncode != 0:
                said.seek(0)
                told = said.read().decode(errors="replace")
                raise SystemExit(f"{told}two_builds: {programs}: {command}: status {process.returncode}")
            self.processor = 1e3 * (usage.ru_utime + usage.ru_stime)
            self.memory = usage.ru_maxrss / 1024
            out.seek(0)
            if (work / "-").exists():
                (work / "-").unlink()
            with (work / "-").open("wb") as kept:
                shutil.copyfileobj(out, kept)


def numbers(text):
    return [float(n) for n in re.findall(rb"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?", text)]


def difference(before, after):
    """What two files have in common, as the CSV tells it. Large ones are not held: a program's memory counts from ours on."""
    if filecmp.cmp(before, after, shallow=False):
        return "equal"
    if before.stat().st_size > 1 << 24:
        return "differs"
    one, other = before.read_bytes(), after.read_bytes()
    a, b = numbers(one), numbers(other)
    if b"\0" in one or b"\0" in other or len(a) != len(b) or not a:
        return "differs"
    largest = max(abs(x) for x in a) or 1
    return f"{max(abs(x - y) for x, y in zip(a, b)) / largest:.2g}"


def measure(case, command, result, builds, threads, work, repeat):
    runs = ([], [])
    for turn in range(repeat + 1):
        for which, programs in enumerate(builds):
            run = Run(programs, NAMES[which], command, threads, work)
            if turn > 0:
                runs[which].append(run)
            elif result is not None:
                (work / result).replace(work / NAMES[which])
    median = lambda which, what: statistics.median(getattr(r, what) for r in runs[which])
    times = [median(0, "time"), median(1, "time")]
    said = "" if result is None else difference(*(work / name for name in NAMES))
    processor = [median(0, "processor"), median(1, "processor")]
    memory = [max(r.memory for r in some) for some in runs]
    print(f"\"{case}\",{threads},{times[0]:.1f},{times[1]:.1f},{times[0] / times[1]:.3f},{processor[0]:.0f},{processor[1]:.0f},{memory[0]:.0f},{memory[1]:.0f},{said}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", type=pathlib.Path)
    parser.add_argument("after", type=pathlib.Path)
    parser.add_argument("--data", type=pathlib.Path, default=pathlib.Path("../shared/data"))
    parser.add_argument("--only", default="")
    parser.add_argument("--repeat", type=int, default=COUNT)
    parser.add_argument("--work", type=pathlib.Path)
    given = parser.parse_args()
    builds = [p.resolve() for p in (given.before, given.after)]
    with tempfile.TemporaryDirectory() as folder:
        work = (given.work or pathlib.Path(folder)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        prepare(builds, given.data.resolve(), work)
        print("case,threads,before_ms,after_ms,times,before_processor_ms,after_processor_ms,before_MB,after_MB,result")
        for case, command, result in CASES:
            if given.only in case:
                for threads in (1, 2) if "$T" in command else (1,):
                    measure(case, command, result, builds, threads, work, given.repeat)


if __name__ == "__main__":
    main()

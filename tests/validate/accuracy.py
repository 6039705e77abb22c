#!/usr/bin/env python3
"""Whether exp2ela --accuracy keeps what it promises: a finger on organs, judged by finer meshes.

  accuracy.py --data FOLDER [--error PERCENT] [--finer N] [--only WORD] [--no-uniform]

A ball presses each organ, which is held at its back. exp2ela --accuracy makes the mesh, ffe-run answers the force. The
true error is against a mesh for an error N times smaller, 4 by default, that is made from other first cells. Beside it are uniform meshes,
with --cell alone. Ends with status 1 where a true error is above the one that was asked for. Programs are found by $PATH.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

# name, how to make its surface, radius of the ball and how deep it presses (mm)
ORGANS = [
    ("liver (SOFA)", "exp2ela -q --transform 'scale 25' --to obj {data}/sofa_liver_smooth.obj -o {obj}", 8, 3),
    ("spleen (HuBMAP)", "exp2ela -q --unit m --repair all --to obj {data}/hubmap_F_spleen_uv.obj -o {obj}", 6, 2),
    ("liver (CT)", "voxelize --label 5 {data}/ts_abdomen_seg_3mm.nii.gz | mc-opt -q --components largest -o {obj}", 8, 4),
    ("kidney (CT)", "voxelize --label 2 {data}/ts_abdomen_seg_3mm.nii.gz | mc-opt -q --components largest -o {obj}", 6, 2),
    ("stomach (CT)", "voxelize --label 6 {data}/ts_abdomen_seg_3mm.nii.gz | mc-opt -q --components largest -o {obj}", 6, 2),
]
MOST = 60000  # tetrahedra


def points_of(path):
    return np.array([[float(x) for x in line.split()[1:4]] for line in path.open() if line.startswith("v ")])


def scene_of(surface, radius, depth):
    """The ball comes down on the highest point near the middle."""
    p = points_of(surface)
    low, high = p.min(axis=0), p.max(axis=0)
    middle = p.mean(axis=0)
    near = p[np.hypot(p[:, 0] - middle[0], p[:, 1] - middle[1]) < 0.15 * (high - low)[:2].min()]
    x, y, z = near[near[:, 2].argmax()]
    lines = ["object organ organ.ela method=ffe", "emit instruments",
             f"instrument finger sphere {radius} {x:.6g} {y:.6g} {z + radius + 1:.6g}", "step",
             f"move finger {x:.6g} {y:.6g} {z + radius - depth:.6g}", "step"]
    return "\n".join(lines) + "\n", f"z<{low[2] + 0.25 * (high - low)[2]:.6g}"


class Case:
    def __init__(self, folder, organ, data):
        self.name, command, radius, depth = organ
        self.folder = pathlib.Path(folder)
        surface = self.folder / "organ.obj"
        subprocess.run(command.format(data=data, obj=surface), shell=True, check=True)
        scene, self.fixed = scene_of(surface, radius, depth)
        (self.folder / "press.scene").write_text(scene)

    def build(self, *options):
        """Seconds, cell, tetrahedra; None with the reason where no mesh is accurate enough."""
        start = time.monotonic()
        done = subprocess.run(["exp2ela", "-q", "--solid", "--material", "liver", "--fix", self.fixed, *options,
                               "organ.obj", "-o", "organ.ela", "--stats=stats"],
                              cwd=self.folder, capture_output=True, text=True)
        if done.returncode != 0:
            print(f"{self.name}: {done.stderr.strip()}", flush=True)
            return None
        stats = json.loads((self.folder / "stats").read_text())
        return time.monotonic() - start, stats["cell"], stats["tetrahedra"]

    def force(self):
        """mN, and seconds."""
        start = time.monotonic()
        said = subprocess.run(["ffe-run", "-q", "press.scene"], cwd=self.folder, capture_output=True, text=True,
                              check=True).stdout
        return float([line for line in said.splitlines() if line.startswith("finger")][-1].split()[6]) / 1000, \
            time.monotonic() - start


def run(case, wanted, finer_by, uniform):
    made = case.build("--accuracy", f"{wanted:g}%", "--for", "press.scene", "--max-tets", str(MOST))
    if made is None:
        return False
    force, solved = case.force()
    finer = case.build("--accuracy", f"{wanted / finer_by:g}%", "--for", "press.scene", "--max-tets", str(MOST),
                       "--cell", f"{0.85 * made[1]:g}")
    if finer is None:
        return False
    truth, _ = case.force()
    error = abs(force / truth - 1)
    print(f"| {case.name} | {truth:.1f} | --accuracy {wanted:g}% | {made[2]} | {100 * error:.1f} % | {made[0]:.0f} | {solved:.0f} |")
    print(f"| | | finer | {finer[2]} | | {finer[0]:.0f} | |", flush=True)
    for share in (1, 0.6) if uniform else ():
        plain = case.build("--cell", f"{share * made[1]:g}")
        force, seconds = case.force()
        print(f"| | | --cell {share * made[1]:.2g} | {plain[2]} | {100 * abs(force / truth - 1):.1f} % | {plain[0]:.0f} | {seconds:.0f} |",
              flush=True)
    return error <= wanted / 100


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--data", required=True)
    arguments.add_argument("--error", type=float, default=5)
    arguments.add_argument("--finer", type=float, default=4)
    arguments.add_argument("--only", default="")
    arguments.add_argument("--no-uniform", action="store_true")
    given = arguments.parse_args()
    data = pathlib.Path(given.data).resolve()
    print("| organ | force, mN | mesh | tetrahedra | true error | s to make | s to solve |\n|---|---|---|---|---|---|---|")
    good = True
    for organ in ORGANS:
        if given.only not in organ[0]:
            continue
        files = [word for word in organ[1].format(data=data, obj="").split() if word.startswith(str(data))]
        if not all(pathlib.Path(file).exists() for file in files):
            print(f"{organ[0]}: skipped, {files[0]} is absent", flush=True)
            continue
        with tempfile.TemporaryDirectory() as folder:
            good = run(Case(folder, organ, data), given.error, given.finer, not given.no_uniform) and good
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

"""Pages of work and error: each stage beside peers, on equal work."""

import shutil
import subprocess

import plot
from modelling import panels
from page import Skipped


def measured(w, page, program, words=(), figures=lambda stage: True):
    """Rows of a benchmark, after their figures of error over time and a table; none where it is skipped."""
    try:
        rows, told = w.bench(program, *words)
    except Skipped as why:
        page.skip(str(why))
        return []
    if not rows:
        page.skip(f"bench_{program} has no rows: {told.strip()}")
        return []
    if figures:
        panels(page, rows, figures, y="error" if "error" in rows[0] else "figure", prefix=program)
    for line in told.splitlines():
        if "skipped" in line or "absent" in line:
            page.skip(line)
    head = [c for c in rows[0] if c not in ("fastest_ms", "slowest_ms")][:10]
    page.say(f"`bench_{program}`, medians; [{program}.csv]({program}.csv) has all rows, `tests/bench/{program}.cpp` describes them.")
    whole = lambda cell: int(cell) if isinstance(cell, float) and cell.is_integer() else cell
    page.table(head, [[whole(r[c]) for c in head] for r in rows])
    return rows


def quickest(rows, stage, program, threads=None):
    """The least median of a program at a stage, ms, and its threads; None if there is none."""
    found = [(r["median_ms"], int(r["threads"])) for r in rows if next(iter(r.values())) == stage and r["program"] == program]
    return min((f for f in found if threads in (None, f[1])), default=None)


def on(threads):
    return "all threads" if threads == 0 else f"{threads} thread{'s' if threads > 1 else ''}"


def beside(page, rows, what, stage, ours, peers):
    """A claim: how long we take at a stage and how long peers do, each beside ours on as many threads where we have that."""
    for peer in peers:
        other = quickest(rows, stage, peer)
        if not other:
            continue
        own = quickest(rows, stage, ours, other[1]) or quickest(rows, stage, ours)
        times = f"{own[0]:,.3g} ms on {on(own[1])}, {peer} {other[0]:,.4g} ms on {on(other[1])}"
        page.claim(what, "–", f"{times}: {other[0] / own[0]:.3g} times as long")


def density(w, page):
    """Densities, and volumes that are added."""
    rows = measured(w, page, "density", ["kernel", "splashsurf"], figures=None)
    for r in rows:
        if r["stage"] == "kernel of peak":
            page.claim(f"{r['program']}", "–", f"{r['error']:.2f}, {r['measure']}")
    peer = [r for r in rows if r["program"] == "splashsurf"]
    for r in peer:
        page.claim("splashsurf, particles to mesh", "–", f"{r['error']:.3g} {r['measure']}")
    rows = measured(w, page, "csg", figures=None)
    for leaves in dict.fromkeys(r["small_leaves"] for r in rows):
        some = [r for r in rows if r["small_leaves"] == leaves]
        beside(page, some, f"add a ball of {leaves:,.0f} leaves to one of {some[0]['large_leaves']:,.0f}", "add", "gewebe", ("openvdb_moved", "openvdb"))


def voxels(w, page):
    """Meshes become voxels."""
    rows = measured(w, page, "voxelize", figures=None)
    stages = list(dict.fromkeys(r["stage"] for r in rows))
    if rows:
        curves = {}
        for r in rows:
            threads = int(r["threads"])
            name = r["program"] + (f", {threads} thread{'s' if threads > 1 else ''}" if threads else "")
            curves.setdefault(name, []).append((float(r["stage"].split()[-1]), r["median_ms"]))
        page.svg("time", plot.curves("A colon of 80,000 triangles becomes voxels", "voxels along an edge", "median time, ms", list(curves.items())), "time")
    for stage in stages:
        beside(page, rows, f"{stage}³", stage, "voxelize: grid", ("Embree rays", "Embree packets of 8", "Embree packets of 16", "VTK stencil", "OpenVDB meshToLevelSet"))


def surface(w, page):
    """Isosurfaces: error over time, quality of triangles."""
    rows = measured(w, page, "geometry")
    finest = min((r["voxel"] for r in rows), default=0)
    some = [r for r in rows if r["voxel"] == finest]
    beside(page, some, f"a ball in voxels of {finest:g} mm", "surface", "mc-opt 0.15", ("OpenVDB volumeToMesh",))
    for program in ("mc-opt 0.15", "OpenVDB volumeToMesh"):
        for r in [r for r in some if r["program"] == program][:1]:
            page.claim(f"{program}: mean distance from the ball", "–", f"{r['error']:.2g} mm")
    rows = measured(w, page, "surface_quality_cgal")
    peers = ("CGAL isotropic remeshing", "OpenVDB volumeToMesh", "VTK FlyingEdges3D", "scikit-image marching_cubes")
    for stage in dict.fromkeys(r["stage"] for r in rows):
        beside(page, rows, f"{stage}, ε = 0.15", stage, "epsilon 0.15", peers)


def tetrahedra(w, page):
    """Volumes filled with tetrahedra."""
    for r in measured(w, page, "stuffing_cgal", ["cgal", "tetgen", "ftetwild", "few"], lambda stage: not stage.endswith("times of ours")):
        if r["measure"] == "times of ours":
            page.claim(f"{r['stage'].removesuffix(' times of ours')}, about {r['size']:,.0f}: {r['program']}", "–", f"{r['error']:.3g} times as long as ours")


def factor(w, page):
    """Sparse factors."""
    rows = measured(w, page, "factor", ["product", "net", "blocks"], figures=None)
    one = [r for r in rows if r["threads"] == 1]
    for size in dict.fromkeys((r["stage"].split(",")[0], r["rows"]) for r in one if "factor" in r["stage"]):
        some = [r for r in one if r["rows"] == size[1]]
        beside(page, some, f"factor of a {size[0]}, {size[1]:,.0f} rows, one thread", f"{size[0]}, factor", "gewebe", ("CHOLMOD",))
    for r in rows:
        if r["stage"] == "matrix product" and r["threads"] == 1:
            page.claim("BLAS's matrix product, one thread", "–", f"{r['figure']:.1f} {r['unit']}")


def statics(w, page):
    """The shape of a pulled organ."""
    rows = measured(w, page, "work_error")
    for kind in dict.fromkeys(r["program"] for r in rows):
        some = [r for r in rows if r["program"] == kind]
        near = [r for r in some if r["figure"] < 1e-3]
        least = min(some, key=lambda r: r["figure"])
        word = f"{min(r['median_ms'] for r in near):.3g} ms" if near else f"not in the time that it had: {least['figure']:.1g} after {least['median_ms']:,.0f} ms"
        page.claim(f"within 1e-3 of the equilibrium, {kind.split(';')[0]}", "–", word)


def dynamics(w, page):
    """Springs and solids in motion."""
    rows = measured(w, page, "ela", figures=lambda stage: stage.startswith("motion"))
    for stage in dict.fromkeys(r["stage"] for r in rows if r["stage"].startswith("speed")):
        beside(page, rows, f"springs, {stage}", stage, "gewebe", ("plain loop",))
    rows = measured(w, page, "solid_motion_peers")
    for stage in dict.fromkeys(r["stage"] for r in rows):
        for kind in dict.fromkeys(r["program"] for r in rows if r["stage"] == stage):
            near = [r["median_ms"] for r in rows if (r["stage"], r["program"]) == (stage, kind) and r["error"] < 0.01]
            page.claim(f"{stage} for 0.2 s, within 1 % of its fall: {kind}", "–", f"{min(near):,.3g} ms" if near else "not with these steps")


def contact(w, page):
    """Contact: forces over what they cost."""
    rows = measured(w, page, "contact_error")
    theory = [r for r in rows if r["program"] == "Gewebe; d_hat" and isinstance(r["theory_error"], float)]
    for r in rows:
        if r["setting"] == 1 and r["program"] in ("Gewebe; d_hat", "Gewebe; stick length"):
            page.claim(f"{r['stage']}, defaults: error of the force ({r['program'].split('; ')[1]})", "–", f"{r['error']:.2g}, {r['median_ms']:.3g} ms")
    for r in sorted((r for r in rows if r["program"] == "MuJoCo flex"), key=lambda r: r["error"])[:1]:
        page.claim(f"{r['stage']}, MuJoCo flex", "–", f"{r['error']:.2g}, {r['median_ms']:,.0f} ms")
    if theory:
        page.say(f"Elements have a larger error than contact: with the smallest d_hat the force of the half-space is missed by {theory[-1]['theory_error']:.2g}.")
    page.say(
        "The setting is that over its default, for MuJoCo its step, the stiffness of contact and the seconds of the scene for a part of the way. "
        "MuJoCo's error is that against its own answer with the stiffest contact. MuJoCo has no elastostatic method: it moves the block until it rests, so its time grows with that of the scene."
    )


PAGES = [
    ("work-density", "Work: densities and what is added to them", "Each stage beside peers", density),
    ("work-voxels", "Work: voxels of a mesh", "Each stage beside peers", voxels),
    ("work-surface", "Work and error: isosurfaces", "Each stage beside peers", surface),
    ("work-tetrahedra", "Work and error: tetrahedra", "Each stage beside peers", tetrahedra),
    ("work-factor", "Work: factors", "Each stage beside peers", factor),
    ("work-statics", "Work and error: the shape of a pulled organ", "Each stage beside peers", statics),
    ("work-contact", "Work and error: contact", "Each stage beside peers", contact),
    ("work-dynamics", "Work and error: motion", "Each stage beside peers", dynamics),
]


def validation(w, page):
    """What make validate says."""
    program = w.build / "validate"
    if w.quick or not program.exists():
        raise Skipped("QUICK=1 validates nothing" if w.quick else "no validate: make report builds it")
    done = subprocess.run([program, w.folder / "validation"], cwd=w.root, env=w.environment, capture_output=True, text=True, check=False)
    text = (w.folder / "validation/README.md").read_text()
    lines = [line for line in text.splitlines() if line.endswith((" passed |", " skipped |", " shown |", "**failed** |"))]
    count = lambda word: sum(line.endswith(f" {word} |") for line in lines)
    page.claim("finite elements and contact against theory, benchmarks, another program, an experiment", "not treated",
               f"{count('passed')} passed, {count('**failed**')} failed, {count('skipped')} skipped")  # fmt: skip
    for picture in sorted((w.folder / "validation").glob("*.svg")):
        shutil.copy(picture, page.picture(picture.stem, ".svg"))
        text = text.replace(f"]({picture.name})", f"]({page.name}-{picture.name})")
    page.say("\n".join(text.splitlines()[2:]))
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "a bound is not kept")

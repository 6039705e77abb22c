"""One picture of all stages, from voxels to frames: how long peers take beside us, how near we are to what the machine can do."""

import math

import plot
from page import Skipped
from workshop import rows_of

# Stage, its CSV, the row's stage, ours, peers, threads of ours and of theirs (0: all that there are).
BESIDE = [
    ("particles to mesh", "density", "particles to mesh", "metaball2vol | mc-opt", ("splashsurf",), (1, 2)),
    ("mesh to voxels, 512³", "voxelize", "voxelize 512", "voxelize: grid", ("Embree rays", "Embree packets of 16", "VTK stencil"), (1,)),
    ("mesh to voxels, 256³", "voxelize", "voxelize 256", "voxelize: grid", ("OpenVDB meshToLevelSet",), (0,)),
    ("volume added to a large one", "csg", "add", "gewebe", ("openvdb", "openvdb_moved"), (2,)),
    ("isosurface, band of a ball", "geometry", "surface", "marching cubes", ("OpenVDB volumeToMesh",), (0,)),
    ("isosurface, liver", "surface_quality_cgal", "surface quality of liver", "epsilon 0", ("VTK FlyingEdges3D", "scikit-image marching_cubes"), (1,)),
    ("tetrahedra of a liver", "stuffing_cgal", "tetrahedra of liver", "ours", ("CGAL Mesh_3", "TetGen -pq"), (1,)),
    ("factor of a net", "factor", "net, factor", "gewebe", ("CHOLMOD",), (1,)),
    ("factor of a block", "factor", "block, factor", "gewebe", ("CHOLMOD",), (1,)),
    ("springs, 10,000 nodes", "ela", "speed 10006 nodes", "gewebe", ("plain loop", "Taichi f64"), (1, 2)),
    ("springs, 100,000 nodes", "ela", "speed 99862 nodes", "gewebe", ("plain loop", "Taichi f64"), (1, 2)),
    ("100,000 triangles to a frame", "render", "scaling", "cpu", ("shader 8bit",), (0,)),
]
# Stage, its CSV, how its fraction of a limit is found there, what the limit is.
LIMITS = [
    ("density, reach of 12 voxels", "density", ("kernel of peak", "density avx2 R 12"), "FMA peak, AVX2"),
    ("density, reach of 1,000", "density", ("kernel of peak", "density avx2 R 1000"), "FMA peak, AVX2"),
    ("columns of compliance", "stiffness", ("columns of matrix product", "ffe-precompute"), "BLAS's matrix product"),
]


def read(folder, name):
    """Rows of a benchmark that stands there; none if it does not."""
    path = folder / f"{name}.csv"
    return rows_of(path.read_text()) if path.exists() else []


def stage_of(row):
    return row.get("stage", row.get("operation"))


def times(rows, stage, program):
    """Medians in ms of a program by the numbers that a row begins with, size and threads among them."""
    return [(r, r["median_ms"]) for r in rows if stage_of(r) == stage and r["program"] == program]


def largest(found):
    """The rows of the largest problem."""
    size = lambda r: max(r.get(k) or 0 for k in ("size", "small_leaves", "triangles", "rows", "nodes", "springs"))
    most = max((size(r) for r, _ in found), default=0)
    return [(r, t) for r, t in found if size(r) > 0.7 * most]


def on_threads(found, threads):
    """The least time on so many threads, or on all, and on how many that is; None if there is none."""
    for count in (threads, 2, 0):
        some = [t for r, t in found if int(r["threads"]) == count]
        if some:
            return min(some), count
    return None


def beside_peers(folder):
    """[(stage, peer, times of ours), ...]"""
    all_ratios = []
    for name, file, stage, ours, peers, threads in BESIDE:
        rows = read(folder, file)
        if file == "csg":
            rows = [r for r in rows if r["small_leaves"] == 63]
        if file == "render":
            rows = [r for r in rows if r["triangles"] == 99856]
        if file == "geometry":
            finest = min((r["voxel"] for r in rows), default=0)
            rows = [r for r in rows if r["voxel"] == finest]
        for peer in peers:
            for count in threads:
                own = on_threads(largest(times(rows, stage, ours)), count)
                other = on_threads(largest(times(rows, stage, peer)), count)
                if own and other:
                    all_ratios.append((f"{name}, {told(own[1])}", f"{peer}, {told(other[1])}", other[0] / own[0]))
    for r in read(folder, "stiffness"):
        if r["stage"] == "columns of peer" and r["program"].endswith("by 32"):
            count = int(r["threads"])
            all_ratios.append((f"columns of compliance, {told(count)}", f"{r['program']}, {told(1)}", r["figure"]))
    factor = read(folder, "factor")
    for kind in ("net", "block"):
        solves = [r for r in factor if r["stage"] == f"{kind}, solve" and r["columns"] == 1]
        own, other = (on_threads(largest(times(solves, f"{kind}, solve", program)), 1) for program in ("gewebe", "CHOLMOD"))
        if own and other:
            all_ratios.append((f"a solve by the factor of a {kind}, {told(1)}", f"CHOLMOD, {told(1)}", other[0] / own[0]))
    beams = read(folder, "solid_motion_peers")
    stage = beams[-1]["stage"] if beams else ""
    for error in (0.01, 0.001):
        within = lambda program: min((r["median_ms"] for r in beams if (r["stage"], r["program"]) == (stage, program) and r["error"] < error), default=None)
        for peer in dict.fromkeys(r["program"] for r in beams if r["stage"] == stage and not r["program"].startswith("gewebe")):
            if within("gewebe") and within(peer):
                all_ratios.append((f"{stage}, within {100 * error:g} %, {told(1)}", f"{peer}, {told(1)}", within(peer) / within("gewebe")))
    return all_ratios


def told(threads):
    return "all threads" if threads == 0 else f"{threads} thread{'s' if threads > 1 else ''}"


def of_limits(folder):
    """[(stage, limit, fraction), ...]"""
    found = []
    for name, file, (stage, program), limit in LIMITS:
        for r in read(folder, file):
            if stage_of(r) == stage and r["program"] == program and r["threads"] == 1:
                found.append((name, limit, r.get("error", r.get("figure"))))
    factor = read(folder, "factor")
    product = next((r["figure"] for r in factor if r["stage"] == "matrix product" and r["threads"] == 1), None)
    for kind in ("net", "block"):
        rates = [(r["rows"], r["figure"]) for r in factor if r["stage"] == f"{kind}, factor" and r["program"] == "gewebe" and r["threads"] == 1]
        if rates and product:
            found.append((f"factor of a {kind}", "BLAS's matrix product", max(rates)[1] / product))
    springs = read(folder, "ela")
    for nodes in ("10006", "99862"):
        stage = f"speed {nodes} nodes"
        least = on_threads(times(springs, stage, "root and division alone"), 1)
        own = on_threads(times(springs, stage, "gewebe"), 1)
        if least and own:
            found.append((f"springs, {int(nodes):,} nodes", "roots and divisions alone", least[0] / own[0]))
    return found


def ratios(w, page):
    """All of them, from what benchmarks of the other pages have left."""
    peers, limits = beside_peers(page.folder), of_limits(page.folder)
    if not peers or not limits:
        raise Skipped("no CSV of benchmarks beside it: the pages of work write them")
    page.svg("all", plot.bars("How long peers take, and how near we are to limits", [("times as long as ours", peers, 1), ("fraction of what the machine can do", limits, 0)]), "ratios")
    quicker = sum(ratio > 1 for *_, ratio in peers)
    page.claim("comparisons with peers on equal work where ours takes less time", "–", f"{quicker} of {len(peers)}")
    page.claim("middle of all, times as long as ours", "–", sorted(ratio for *_, ratio in peers)[len(peers) // 2])
    page.claim("fractions of limits", "–", f"{min(f for *_, f in limits):.2f} to {max(f for *_, f in limits):.2f}")
    page.say(
        "Each line is one comparison of a page of work; times are medians, most of seven. Single-threaded peers are compared on one thread. Errors are on the pages of work."
    )
    page.table(("stage", "peer", "times as long as ours"), peers)
    page.table(("stage", "limit", "fraction"), limits)
    page.note = "Measured as the pages of work say, whose CSVs this is drawn from."
    assert all(math.isfinite(ratio) for *_, ratio in peers + limits)


PAGES = [("ratios", "All stages in one picture", "From voxels to frames", ratios)]

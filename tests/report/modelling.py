"""Pages of the report's sections 3.1 and 4.1: particles, volumes, meshes."""

import csv

import plot
from page import Skipped


def triangles(w, page):
    """Figure 3-2."""
    organ, myomas = (w.root / "examples/myoma" / f"{name}.particles" for name in ("organ", "myoma"))
    w.run(f"metaball2vol --voxel 1 {organ} -o organ.vdb && metaball2vol --like organ.vdb {myomas} | csg add organ.vdb - -o both.vdb")
    kinds = [
        ("marching cubes alone", "--epsilon 0"),
        ("ε = 0.15", "--epsilon 0.15"),
        ("ε = 0.5", "--epsilon 0.5"),
        ("ε = 0.15, regularized", "--epsilon 0.15 --regularize 10"),
    ]
    rows, pictures, found = [], [], []
    for k, (name, options) in enumerate(kinds):
        s = w.stats(f"mc-opt --resample 5 {options} --self-intersections both.vdb -o {k}.ply", 3)
        found.append(s)
        rows.append([
            name, s["points"], s["triangles"], s["smallest_angle"], s["angle_1_percent"], 100 * s["angles_below_10"],
            s["edge_max"] / s["edge_min"], s["explicit_step"], 1e3 * s["seconds"]["marching_cubes"],
            1e3 * (s["seconds"].get("snap", 0) + s["seconds"].get("regularize", 0)),
        ])  # fmt: skip
        w.run(f"mc-opt --resample 5 {options} --to obj both.vdb -o {k}.obj")
        picture = page.picture(str(k), ".svg")
        picture.write_text(plot.front_faces(w.folder / f"{k}.obj", (-28, 32, 60, 60)))
        pictures.append((picture, name))
    page.claim("small triangles beside degenerate ones go", "a picture", f"{found[0]['triangles']:,} → {found[1]['triangles']:,} triangles")
    page.claim("share of triangles with an angle below 10°", "–", f"{rows[0][5]:.1f} % → {rows[1][5]:.2g} %")
    page.claim("the mesh stays closed and manifold", "–", "yes" if all(s["closed"] and s["manifold"] for s in found) else "**no**")
    page.say("The organ of `examples/myoma` with its myomas, voxels of 5 mm. Points within ε voxel edges of a voxel centre become one.")
    page.pictures(pictures)
    page.table(
        ("", "points", "triangles", "smallest angle, °", "angle of the worst 1 %, °", "below 10°, %", "longest over shortest edge",
         "explicit step over √voxel", "marching cubes, ms", "snapping and rest, ms"),
        rows,
    )  # fmt: skip


def reduction(w, page):
    """Figure 3-3."""
    dims, seeds = ("8 16", 1) if w.quick else ("8 16 32 64 128", 5)
    folder = w.example("reduction")
    w.run(f"make -s reduction.csv fit.csv DIMS='{dims}' SEEDS={seeds}", folder=folder)
    rows = list(csv.DictReader((folder / "reduction.csv").open()))
    fits = list(csv.DictReader((folder / "fit.csv").open()))
    last = dims.split()[-1]
    at = lambda what: next(100 * float(r[what]) for r in rows if r["dim"] == last and float(r["epsilon"]) == 0.15)
    fit = {f["of"]: f for f in fits if f["dim"] == last}
    page.claim("reduction over ε", "nearly linear (8³ to 128³)", f"linear: R² = {float(fit['points']['r2']):.4f} at {last}³")
    page.claim("slope, points saved over ε", "read from a diagram only", f"{float(fit['points']['slope']):.3f}")
    page.claim("at the report's choice ε = 0.15", "“a good compromise”", f"{at('points'):.1f} % of points, {at('triangles'):.1f} % of triangles saved")
    page.say(f"Five particles, the mean of {seeds} random scenes; `examples/reduction` holds the rules (`make check` there bounds R²).")
    for what in ("points", "triangles"):
        data = [(f"{d}³", [(float(r["epsilon"]), 100 * float(r[what])) for r in rows if r["dim"] == d]) for d in dims.split()]
        page.svg(what, plot.curves(f"Reduction of {what}", "ε, voxel edges", f"{what} saved, %", data, False, False), f"{what} saved")
    page.table(
        ("of", "voxels", "slope", "intercept", "R²"), [[f["of"], f"{f['dim']}³", float(f["slope"]), f["intercept"], f["r2"]] for f in fits]
    )


def particles(w, page):
    """Figure 4-1."""
    source = w.root / "examples/pull/five.particles"
    size = 160 if w.quick else 380
    field = page.picture("density", ".png")
    w.run(f"metaball2vol --voxel 1 {source} -o five.vdb")
    w.run(f"emboss-render --translucent view --ramp rainbow --range 0.1,1.3 --extinction 0.08 --size {size} five.vdb -o {field}")
    dense = w.stats(f"metaball2vol --voxel 0.5 {source} -o fine.vdb", 3)
    meshed = w.stats("mc-opt five.vdb -o five.ply", 3)
    pictures = [(field, "density")]
    for style in ("wireframe", "flat", "textured"):
        picture = page.picture(style, ".png")
        mesh = "five.ply" if style == "textured" else "coarse.ply"
        if mesh == "coarse.ply":
            w.run(f"metaball2vol --voxel 4.2 {source} | mc-opt -o coarse.ply")
        w.run(f"emboss-render --backend cpu --style {style} --color 0.85,0.52,0.46 --size {size} {mesh} -o {picture}")
        pictures.append((picture, style))
    page.claim("particles → density → isosurface", "pictures", "the same, and numbers below")
    page.claim("voxels evaluated, of all in the box", "only within reach of particles", f"{dense['voxel_evaluations'] / box(dense):.1%}")
    page.claim("from particles to a mesh, ms", "“interactive”", 1e3 * (meshed["seconds"]["marching_cubes"] + meshed["seconds"]["snap"]))
    page.pictures(pictures)
    page.say(
        f"At voxels of 0.5 mm {dense['active_voxels']:,} voxels hold a value, the density takes {1e3 * dense['seconds']['density']:.0f} ms. "
        f"The surface at 1 mm has {meshed['points']:,} points and {meshed['triangles']:,} triangles."
    )


def box(stats):
    """Voxels of the box that all particles fill."""
    count = 1.0
    for low, high, edge in zip(stats["box_min"], stats["box_max"], stats["voxel_size"]):
        count *= round((high - low) / edge) + 1
    return count


def myoma(w, page):
    """Figures 3-4 and 4-4."""
    particles_of = lambda name: w.root / f"examples/myoma/{name}.particles"
    dim, voxel = (64, 4) if w.quick else (256, 1.6)
    repeats = 3
    w.run(f"metaball2vol --voxel 0.5 {particles_of('organ')} | mc-opt -o organ.ply")
    volume = w.stats(f"voxelize --dim {dim} --antialias box:4 organ.ply -o organ.vdb", repeats)
    binary = w.stats(f"voxelize --dim {dim} --antialias none organ.ply -o binary.vdb", repeats)
    added = w.stats(f"metaball2vol --like organ.vdb {particles_of('myoma')} -o myoma.vdb", repeats)
    both = w.stats("csg add organ.vdb myoma.vdb -o both.vdb", repeats)
    mesh = w.stats(f"mc-opt --resample {voxel} --epsilon 0.3 both.vdb -o uterus.ply", repeats)
    build = "exp2ela --material uterus --bend --central-stiffness 3"
    model = w.stats(f"{build} uterus.ply -o uterus.ela", repeats)
    tip = "sphere:-3,6,75,4"
    store = w.stats(f"ffe-precompute --columns '{tip}' uterus.ela -o uterus.h5", repeats)
    scene = [f"object uterus uterus.ela store=uterus.h5", f"displace uterus near:-3,6,75,6 0 0 6", "step"]
    (w.folder / "pull.scene").write_text("\n".join(scene) + "\n")
    pull = w.stats("ffe-run -q pull.scene -o pull.h5", repeats)
    w.run(f"{build} organ.ply -o organ.ela")
    pictures = []
    look = f"--backend cpu --color 0.82,0.5,0.46 --wet 0.8 --occlusion 0.8 --background 0.3,0.27,0.28 --size {160 if w.quick else 400} --target 0,4,25 --distance 250"
    for name, source, caption in (("organ", "organ.ply", "the mesh"), ("myomas", "uterus.ela", "five myomas added"), ("pulled", "pull.h5", "one pulled by 6 mm")):
        picture = page.picture(name, ".png")
        w.run(f"emboss-render {look} {source} -o {picture}")
        pictures.append((picture, caption))
    steps = [
        (f"voxelise, {dim}³, grey values of 4³ samples", volume["seconds"]["total"]),
        (f"voxelise, {dim}³, binary as in the report", binary["seconds"]["total"]),
        ("density of five myomas", added["seconds"]["total"]),
        ("add", both["seconds"]["total"]),
        (f"mesh at {voxel} mm", mesh["seconds"]["total"]),
        ("model", model["seconds"]["total"]),
        ("factor and columns", store["seconds"]["total"]),
        ("pull, elastostatic", pull["seconds"]["total"]),
    ]
    page.claim("resolution of the voxel model", "256³", f"{dim}³")
    page.claim("particles that become myomas", 5, 5)
    page.claim("mesh at a lower resolution “for real time”", "yes", f"{mesh['points']:,} points, closed: {'yes' if mesh['closed'] else 'no'}")
    page.claim("from mesh to pulled model", "–", f"{sum(s for _, s in steps) - steps[1][1]:.2f} s")
    page.pictures(pictures)
    page.table(("step, with reading and writing", "ms"), [(name, 1e3 * s) for name, s in steps])
    try:
        organ = w.shared("hubmap_female_reproductive.obj")
    except Skipped as why:
        page.skip(f"the real organ, {why}")
        return
    s = w.stats(f"voxelize --unit m --rule winding --dim {dim} {organ} -o real.vdb", 1)
    page.say(
        f"The report's organ was a mesh of uterus, ovaries and tubes. Such a one of the shared data (HuBMAP, {s['triangles']:,} triangles, "
        f"open and cutting itself) becomes {dim}³ voxels in {s['seconds']['total']:.2f} s."
    )


def antialias(w, page):
    """Figures 4-5 and 4-6."""
    dim = 32 if w.quick else 128
    size = 160 if w.quick else 400
    w.run(f"metaball2vol --voxel 0.5 {w.root / 'examples/myoma/organ.particles'} | mc-opt -o organ.ply")
    exact = w.stats("voxelize --antialias exact --dim 192 organ.ply -o whole.vdb")["volume"]
    rows, meshes, volumes, found = [], [], [], {}
    for name, option, caption in (
        ("none", "none", f"direct, {dim}³"),
        ("box", "box:6", f"{6 * dim}³ scaled to {dim}³"),
        ("exact", "exact", "exact fractions"),
        ("jones", "jones", "Jones 1996"),
        ("sramek", "sramek", "Šrámek, Kaufman 1999"),
    ):
        s = w.stats(f"voxelize --dim {dim} --antialias {option} organ.ply -o {name}.vdb", 3)
        found[name] = s
        w.run(f"mc-opt {name}.vdb -o {name}.ply")
        rows.append([caption, 1e3 * s["seconds"]["total"], s["volume"], 100 * abs(s["volume"] / exact - 1) if name not in ("jones", "sramek") else None])
        if name in ("none", "box", "exact"):
            solid, mesh = page.picture(f"{name}-volume", ".png"), page.picture(f"{name}-mesh", ".png")
            w.run(f"emboss-render --translucent y --range 0.05,1 --extinction 2 --size {size} {name}.vdb -o {solid}")
            w.run(f"emboss-render --backend cpu --shade 0.9 --color 0.85,0.55,0.5 --background 0.32,0.29,0.3 --size {size} {name}.ply -o {mesh}")
            volumes.append((solid, f"{caption}: volume"))
            meshes.append((mesh, f"{caption}: mesh"))
    page.claim("sizes compared", "128³; 768³ scaled to 128³", f"{dim}³; {6 * dim}³ scaled to {dim}³")
    page.claim("error of the volume, direct → scaled", "pictures only", f"{rows[0][3]:.2g} % → {rows[1][3]:.2g} %")
    page.claim("filters “to be compared” (section 5): Jones, Šrámek and Kaufman", "not done", "done, below")
    page.pictures(volumes)
    page.pictures(meshes)
    page.table(("filter", "ms, with reading and writing", "volume, mm³", "off, %"), rows)
    try:
        data, _ = w.bench("antialias")
    except Skipped as why:
        page.skip(f"error over time, {why}")
        return
    panels(page, data, lambda stage: stage.endswith(("volume", "position mean")))


def panels(page, rows, wanted, x="median_ms", y="error", x_name="median time, ms", prefix="error"):
    """A figure for each stage: y over x for each program."""
    for n, stage in enumerate(dict.fromkeys(r["stage"] for r in rows if wanted(r["stage"]))):
        data, measure = {}, ""
        for r in rows:
            if r["stage"] == stage and isinstance(r[x], float) and isinstance(r[y], float):
                threads = int(r.get("threads") or 0)
                name = str(r["program"]) + (f", {threads} thread{'s' if threads > 1 else ''}" if threads else "")
                data.setdefault(name, []).append((r[x], r[y]))
                measure = r.get("measure") or r.get("unit") or y
        if not any(b > 0 and a > 0 for points in data.values() for a, b in points):
            continue
        page.svg(f"{prefix}-{n}", plot.curves(stage, x_name, measure, list(data.items())), stage)

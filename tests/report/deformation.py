"""Pages of the report's sections 3.3, 4.1 and 4.3: elastodynamics, elastostatics, hybrid scenes."""

import csv
import os
import re

import machine
import plot
from page import Skipped


def two_step(w, page):
    """Figure 3-10."""
    folder = w.example("two-step")
    w.run("make -s two-step.csv inverse.csv", folder=folder)
    rows = list(csv.reader((folder / "two-step.csv").open()))[1:]
    inverse = [list(map(float, r[1:])) for r in csv.reader((folder / "inverse.csv").open())]
    names = {"first": "K1 alone", "second": "K2 alone, 4 times as stiff", "two": "two-step, eq. 3.4", "series": "two-step, series"}
    curve = {key: [(float(r[4]), float(r[1]) / 1e3) for r in rows if r[0] == key] for key in names}
    data = [(name, curve[key]) for key, name in names.items()]
    f0 = 20.0
    u0 = next(u for u, f in curve["first"] if f == f0)
    off = max(abs(r[4] - r[0]) for r in inverse) / (1e3 * f0)
    slope = lambda c: (c[-1][1] - c[-2][1]) / (c[-1][0] - c[-2][0])
    page.claim("below (u0, f0) the curve is that of K1", "yes", "yes" if all(a == b for a, b in zip(curve["first"], curve["two"]) if a[1] <= f0) else "**no**")
    page.claim("beyond it more force is needed", "yes", f"{slope(curve['two']) / slope(curve['first']):.2f} times as stiff (eq. 3.4 as it is read)")
    page.claim("less deformed than by K1 alone, at 2 f0", "yes", f"{1 - curve['two'][-1][0] / curve['first'][-1][0]:.0%}")
    page.claim("the displacement given, the force found", "not treated", f"to {off:.1e} of f0")
    page.say(f"A node of a soft organ, f0 = {f0:g} mN, u0 = {u0:.3g} mm; `examples/two-step` holds the rules.")
    page.svg("curve", plot.curves("Force over displacement (figure 3-10)", "displacement u, mm", "force f, mN", data, False, False, False), "figure 3-10")


def nodes_of(path):
    """Of a model's file."""
    with path.open() as file:
        return int(next(line for line in file if line.startswith("nodes ")).split()[1])


def storage(w, page):
    """Section 3.3.3: 72 n² bytes."""
    total = 192 if w.quick else 2400
    rows, plain = [], {}
    for k in (1, 2, 4, 8):
        rings = round((total / k / 2) ** 0.5)
        w.run(f"for i in $(seq {k}); do exp2ela --primitive sphere:{2 * rings}x{rings} --fix 'z<-3' --bend --name o$i -o o$i.ela; done")
        models = " ".join(f"o{i + 1}.ela" for i in range(k))
        counts = [nodes_of(w.folder / model) for model in models.split()]
        nodes, formula = sum(counts), sum(72 * n**2 for n in counts)
        row = [k, nodes, formula / 1e6]
        for what, options in (("float64", "--columns all --precision float64"), ("float32", "--columns all --precision float32"),
                              ("compressed", "--columns all --compress 1e-4"), ("factor", "--columns none")):  # fmt: skip
            s = w.stats(f"ffe-precompute {options} {models} -o {what}.h5")
            row.append(os.path.getsize(w.folder / f"{what}.h5") / 1e6)
            plain[k, what] = (row[-1], s["seconds"]["total"])
        rows.append(row)
    large = 1000 if w.quick else 10000
    rings = round((large / 2) ** 0.5)
    w.run(f"exp2ela --primitive sphere:{2 * rings}x{rings} --fix 'z<-3' --bend --name large -o large.ela")
    nodes = nodes_of(w.folder / "large.ela")
    s = w.stats("ffe-precompute --columns none large.ela -o large.h5", 3)
    size = os.path.getsize(w.folder / "large.h5") / 1e6
    page.claim("bytes of a whole matrix, n nodes", "72 n²", f"72 n² = {rows[0][2]:.1f} MB, file {rows[0][3]:.1f} MB (n = {rows[0][1]:,})")
    page.claim("k objects of n/k nodes", "72 n²/k", f"{rows[0][3] / rows[-1][3]:.2f} times less with k = {rows[-1][0]}")
    page.claim(f"{10000 if not w.quick else nodes:,} nodes", "7.2 GB", f"{size:.1f} MB: the sparse factor, any column from it ({nodes:,} nodes)")
    page.claim("time of the preparation", "minutes to hours", f"{s['seconds']['total']:.2f} s for these {nodes:,} nodes")
    page.say("A whole matrix has the columns of the inverse for all nodes. A store needs them only for fast contacts; its factor gives the rest.")
    page.table(("objects k", "nodes", "72 Σ n², MB", "float64, MB", "float32, MB", "within 1e-4, MB", "factor alone, MB"), rows)
    data = [(name, [(r[0], r[c]) for r in rows]) for c, name in ((2, "72 n²/k"), (3, "float64"), (4, "float32"), (5, "within 1e-4"), (6, "factor alone"))]
    page.svg("size", plot.curves(f"Size of a store, {rows[0][1]:,} nodes in all", "objects k", "MB", data), "size of a store")
    page.say(f"Whole float64 columns of one object took {plain[1, 'float64'][1]:.2f} s, its factor alone {plain[1, 'factor'][1]:.2f} s.")
    try:
        columns, _ = w.bench("stiffness", "columns", "liver")
    except Skipped as why:
        page.skip(f"columns by relaxation, {why}")
        return
    page.heading("Columns by relaxation, as in the report, and from a factor")
    page.say("The report relaxes the system under a pull until all speeds are small (adaptive), or for a number of steps. A column from the factor does not have this error.")
    curves = {}
    for r in columns:
        if r["stage"].startswith("relaxation of "):
            kind = "adaptive" if str(r["program"]).startswith("threshold") else "a number of steps"
            curves.setdefault(f"{kind}, {r['stage'][len('relaxation of '):]}", []).append((r["median_ms"], r["figure"]))
        if r["stage"].startswith("a column relaxed") and "default" in str(r["program"]):
            page.claim(f"a column by adaptive relaxation, of one from the factor ({r['stage'].split(', ')[-1]})", "the only way", f"{r['figure']:,.0f} times the time")
    for points in curves.values():
        points.sort()
    if curves:
        page.svg("relaxation", plot.curves("A column by relaxation", "median time, ms", "error over the largest displacement", list(curves.items())), "relaxation")
    page.table(("", "", "nodes", "columns", "threads", "median, ms", "figure", ""),
               [[str(r["stage"]), str(r["program"]), int(r["nodes"]), int(r["columns"]), int(r["threads"]), r["median_ms"], r["figure"], str(r["unit"])]
                for r in columns if not r["stage"].startswith(("relaxation", "a column relaxed"))])  # fmt: skip


def rates(w, model, safe_step, repeats=3):
    """Of a model under its weight, on one thread and on all: integration steps a second, times of real time."""
    found, seconds = {}, (200 if w.quick else 3000) * safe_step
    for threads in dict.fromkeys((1, machine.cores())):
        (w.folder / "fall.scene").write_text(f"object o {model}\ngravity 0 0 -9810\nrun {seconds} every {seconds}\n")
        s = w.stats(f"ffe-run -q -j{threads} fall.scene -o fall.h5", repeats)
        found[threads] = (s["integration_steps"] / s["seconds"]["run"], seconds / s["seconds"]["run"])
    return found


def cycles(w, page):
    """Figures 4-1, 4-2 and 4-3."""
    folder = w.example("pull")
    w.run("make -s five.ela organ.obj", folder=folder)
    s = w.stats("exp2ela pull/five.ela -o /dev/null")
    rows = []
    edges = lambda t: t["springs_e"]

    def measure(name, model, told, report):
        for threads, (steps, real) in rates(w, model, told["safe_step"]).items():
            rows.append([name, told["nodes"], edges(told), threads, steps, 60 * real, 1e3 * told["safe_step"], report])
        return max((r for r in rows if r[0] == name), key=lambda r: r[4])

    best = measure("five particles", "pull/five.ela", s, "12")
    page.claim("nodes, springs of five particles", "920, 2,658", f"{s['nodes']:,}, {edges(s):,} along edges")
    page.claim("their cycles a second (integration steps)", 12, f"{best[4]:,.0f} on {best[3]} thread(s)")
    page.claim("… counted as frames of 1/60 s of simulated time", "–", f"{best[5]:,.0f}")
    w.run("exp2ela --bend --material liver,1=gallbladder pull/organ.obj -o organ.ela")
    organ = w.stats("exp2ela organ.ela -o /dev/null")
    measure("liver and gall bladder of particles", "organ.ela", organ, "–")
    try:
        source = w.shared("ts_liver_gallbladder_portal.dxf")
        real = w.stats(f"exp2ela --bend {source} -o real.ela")
        measure("a patient's, as the DXF has it", "real.ela", real, "–")
        w.run(f"voxelize --voxel 5 --antialias exact {source} | mc-opt -o near.ply")
        near = w.stats("exp2ela --bend near.ply -o near.ela")
        best = measure("the same, about the report's size", "near.ela", near, "3")
        page.claim("nodes, springs of liver and gall bladder (DXF)", "4,533, 13,558", f"{near['nodes']:,}, {edges(near):,} along edges")
        page.claim("its cycles a second (integration steps)", 3, f"{best[4]:,.0f} on {best[3]} thread(s)")
        page.claim("… counted as frames of 1/60 s of simulated time", "–", f"{best[5]:,.0f}")
    except Skipped as why:
        page.skip(f"the DXF of figure 4-3, {why}")
    page.say(
        "The report says “12 elastodynamic cycles, which is the frame rate”, on a Pentium III of 1 GHz. It does not say if a cycle was one integration step or more, so both are shown: integration steps, and frames of 1/60 s. Each model also has bending springs, gravity acts, and nothing sleeps."
    )
    page.table(("model", "nodes", "springs along edges", "threads", "steps/s", "frames of 1/60 s per second", "safe step, ms", "report, cycles/s"), rows)
    w.run("make -s five-before.png five-after.png organ-before.png organ-after.png", folder=folder)
    pictures = []
    for name, caption in (("five-before", "five particles"), ("five-after", "pulled"), ("organ-before", "liver and gall bladder"), ("organ-after", "pulled")):
        picture = page.picture(name, ".png")
        (folder / f"{name}.png").replace(picture)
        pictures.append((picture, caption))
    page.pictures(pictures)


def hybrid(w, page):
    """Figure 4-9."""
    folder = w.example("cholecystectomy")
    size = 160 if w.quick else 420
    if not w.quick:
        w.run("make -s run.h5", folder=folder)
        share = w.run("make -s share", folder=folder).stdout.strip()
        pictures = []
        look = "--by object --color 0.6,0.27,0.19 --color 1=0.55,0.6,0.36 --color 2=0.84,0.8,0.6 --color 3=0.86,0.25,0.2 --color 4=0.9,0.66,0.58"
        for name, frame, caption in (("before", 0, "before"), ("after", -1, "grasped and lifted")):
            picture = page.picture(name, ".png")
            w.run(f"emboss-render --backend cpu {look} --wet 0.7 --occlusion 0.8 --background 0.16,0.1,0.1 --size {size} "
                  f"--eye 120,290,-175 --target 14,8,2 --frame {frame} run.h5 -o {picture}", folder=folder)  # fmt: skip
            pictures.append((picture, caption))
        page.pictures(pictures)
        page.say(f"The scene of `examples/cholecystectomy`: {share}")
    try:
        rows, told = w.bench("break_even")
    except Skipped as why:
        page.skip(f"figure 4-9, {why}")
        return
    lines = told.strip().splitlines()
    ratio = next(re.search(r"([0-9.]+) % elastostatic: ([0-9.]+) times", line) for line in lines if "no load" in line)
    page.claim("elastostatic nodes", "66.2 %", f"{float(ratio.group(1)):.1f} %")
    page.claim("… speed without load, of elastodynamics alone", "2 times (205 cycles a minute)", f"{float(ratio.group(2)):.2f} times")
    even = [re.search(r"^(.*?), (cycles of .*?), (hybrid .*?): break-even (.*?) contacts", line) for line in lines]
    even = [m.groups() for m in even if m]
    for what in dict.fromkeys(e[1] for e in even):
        mine = next(e for e in even if e[1] == what and e[2] == "hybrid float64")
        page.claim(f"break-even, {what}", "14 contacts", f"{mine[3]} contacts")
    page.say("Left of the figure: cycles per second over the share of elastostatic nodes without contact. The report found them proportional.")
    for n, stage in enumerate(dict.fromkeys(r["stage"] for r in rows)):
        if " over " not in stage:
            continue
        title, over = stage.split(" over ")
        data = {}
        for r in rows:
            if r["stage"] == stage:
                data.setdefault(str(r["program"]), []).append((r["size"], r["figure"]))
        unit = str(next(r["unit"] for r in rows if r["stage"] == stage))
        even_axes = not over.endswith("(log)")
        x = over.removesuffix(" (log)")
        page.svg(str(n), plot.curves(title, x, unit, list(data.items()), not even_axes, not even_axes or "cycles of one" in title), title)
    page.heading("Break-even")
    page.table(("scene", "a cycle", "program", "break-even, contacts"), even)
    page.code(lines)


def latency(w, page):
    """A thousand answers a second; what the report's successors need."""
    try:
        rows, told = w.bench("latency", "10", "spheres=3", "store", f"to={w.folder}/latency")
    except Skipped as why:
        page.skip(str(why))
        return
    by = {r["stage"]: r for r in rows}
    a, b = by["latency"], by["work"]
    page.claim("contacts answered, forces and instruments", "14 contacts halve 205 cycles a minute", f"{a['contacts']:.0f} contacts at 1,000 a second")
    page.claim("answers within a millisecond", "–", f"{1 - a['figure'] / a['answers']:.3%} of {a['answers']:,.0f}")
    page.claim("half, 99 %, 99.9 %, the largest, ms", "–", f"{a['p50_ms']:.3f}, {a['p99_ms']:.3f}, {a['p999_ms']:.3f}, {a['largest_ms']:.2f}")
    page.claim("processor's time of an answer: half, 99.9 %, ms", "–", f"{b['p50_ms']:.3f}, {b['p999_ms']:.3f}")
    page.say(f"Three spheres slide over a net of {a['nodes']:,.0f} nodes; the client requests answers by the clock, through a pipe. {told.strip().splitlines()[-1]}.")
    page.svg("histogram", (w.folder / "latency/latency.svg").read_text(), "latencies")

"""Pages of the report's sections 3.2 and 4.2: embossed textures."""

import csv
import pathlib

import machine
import plot
from page import Skipped

MODES = (("3", "render-pass-3"), ("2", "render-pass-2"), ("1", "render-pass-1"), ("shader", "one shader"), ("cpu", "our rasteriser"))


def lungs(w, size):
    """The lungs of examples/lung and their textures."""
    folder = w.example("lung")
    w.run("make -s lung.ply base.ppm detail.ppm reflection.ppm structure.pgm", folder=folder)
    return folder, f"--plain --background 0.05,0.05,0.06 --msaa 4 --orbit 15,8 --size {size}"


def by_graphics_card():
    """Rows of a table and its numbers of triangles, of the measured graphics_card.csv (threads 0: all)."""
    fast, error = {}, {}
    for r in csv.DictReader(pathlib.Path(__file__).with_name("graphics_card.csv").open()):
        if r["threads"] == "0":
            fast.setdefault(r["program"], {})[int(r["triangles"])] = float(r["frames/s"])
            error[r["program"]] = float(r["error"])
    sizes = sorted(next(iter(fast.values())))
    return [[name, *(points[n] for n in sizes), error[name]] for name, points in fast.items()], sizes


def emboss(w, page):
    """Figures 3-6 to 3-9."""
    folder, look = lungs(w, 160 if w.quick else 320)
    surface = "--uv box --uv-scale 70 --offset 0.011 --texture base.ppm --structure structure.pgm lung.ply"
    renderer = machine.gl_renderer(w)
    pictures = []
    for mode, name in MODES:
        if mode != "cpu" and not renderer:
            continue
        how = "--backend cpu" if mode == "cpu" else f"--backend gl --passes {mode}"
        picture = page.picture(mode, ".png")
        w.run(f"emboss-render {how} {look} {surface} -o {picture}", folder=folder)
        pictures.append((picture, name))
    page.claim("algorithms", "3, 2 and 1 passes on OpenGL", "the same three, one shader, a rasteriser without OpenGL")
    page.claim("who draws", "GeForce 6600GT, Pentium III 1 GHz", f"{renderer or 'no OpenGL'}; {machine.processor()}, {machine.cores()} cores")
    page.pictures(pictures)
    if not renderer:
        page.skip("the algorithms on OpenGL: no EGL here")
    try:
        rows, _ = w.bench("render", "100000")
    except Skipped as why:
        page.skip(f"figure 3-9, {why}")
        return
    chosen = {
        "passes 3 8bit": "render-pass-3", "passes 2 8bit": "render-pass-2", "passes 1 8bit": "render-pass-1",
        "shader 8bit": "one shader", "cpu": "our rasteriser", "cpu by vertex": "our rasteriser, light by vertex",
    }  # fmt: skip
    fast, error = {}, {}
    threads = max(int(r["threads"]) for r in rows)
    for r in rows:
        if r["program"] in chosen and int(r["threads"]) in (0, threads):
            (fast if r["stage"] == "scaling" else error).setdefault(chosen[r["program"]], {})[int(r["triangles"])] = r["error"]
    curves = [(name, sorted(points.items())) for name, points in fast.items()]
    page.svg("rates", plot.curves("Frames per second (figure 3-9)", "triangles", "frames/s", curves), "frames per second")
    sizes = sorted(next(iter(fast.values())))
    page.say("A torus in 512 × 512 pixels with a moving camera. Errors compare a picture with the formula in double precision, as RMS of 255.")
    page.table(
        ("", *(f"frames/s, {n:,} triangles" for n in sizes), "error, RMS"),
        [[name, *(points.get(n) for n in sizes), error.get(name, {}).get(sizes[-1])] for name, points in fast.items()],
    )
    card, sizes_there = by_graphics_card()
    page.say("The same benchmark on another machine, with OpenGL on a graphics card: an NVIDIA H100 (driver 580.159.04) beside 16 cores, 2026-11-26. Its texture filters have 8 bits, which causes the errors.")  # fmt: skip
    page.table(("", *(f"frames/s, {n:,} triangles" for n in sizes_there), "error, RMS"), card)
    three, one = fast.get("render-pass-3"), fast.get("render-pass-1")
    if three and one:
        page.claim("one pass is a little faster than three", "“somewhat higher”", f"{one[sizes[0]] / three[sizes[0]]:.2f} times at {sizes[0]:,} triangles")
        page.claim("at many triangles all three are nearly equal", "yes", f"{one[sizes[-1]] / three[sizes[-1]]:.2f} times at {sizes[-1]:,} triangles")
    if error.get("render-pass-1") and error.get("render-pass-3"):
        a, b = error["render-pass-1"][sizes[-1]], error["render-pass-3"][sizes[-1]]
        page.claim("one pass has the worse picture", "yes, colours at half their strength", f"{'no' if a <= b else 'yes'}: RMS {a:.2g} of 255, {b:.2g} with three (RGB scale 2)")
    page.claim("our rasteriser", "–", f"{fast['our rasteriser'][sizes[0]]:.0f} frames/s at {sizes[0]:,} triangles, RMS {error['our rasteriser'][sizes[0]]:.2g}")


def lung(w, page):
    """Figures 4-7 and 4-8."""
    folder, look = lungs(w, 160 if w.quick else 320)
    surface, coordinates = "--backend cpu", "--uv triplanar --uv-scale 70 --offset 0.011"
    every = "--texture base.ppm --detail detail.ppm --reflection reflection.ppm --structure structure.pgm"
    single, together = [], []
    for name, options in (
        ("base", f"{coordinates} --texture base.ppm"),
        ("detail", f"{coordinates} --color 0,0,0 --detail detail.ppm"),
        ("reflection", "--color 0,0,0 --reflection reflection.ppm"),
        ("structure", f"{coordinates} --color 0.5,0.5,0.5 --structure structure.pgm"),
    ):
        picture = page.picture(name, ".png")
        w.run(f"emboss-render {look} {surface} {options} lung.ply -o {picture}", folder=folder)
        single.append((picture, name))
    for name, options in (("all", ""), ("left", "--light 900,400,0"), ("right", "--light -900,400,0")):
        picture = page.picture(name, ".png")
        w.run(f"emboss-render {look} {surface} {coordinates} {every} {options} lung.ply -o {picture}", folder=folder)
        together.append((picture, "all four" if name == "all" else f"light from the {name}"))
    picture = page.picture("wet", ".png")
    wet = "--texture base.ppm --detail detail.ppm --structure structure.pgm --uv triplanar --uv-scale 60 --offset 0.006 --wet 1 --occlusion 0.9"
    w.run(f"emboss-render --backend cpu --background 0.32,0.29,0.3 --orbit 15,8 --size {160 if w.quick else 320} {wet} lung.ply -o {picture}", folder=folder)
    together.append((picture, "a film of water instead"))
    page.claim("textures composed", "4: base, detail, reflection, structure", "the same 4")
    page.say("Lungs made of particles, with textures one by one (figure 4-7) and together (figure 4-8), projected from three sides.")
    page.pictures(single)
    page.pictures(together)
    frames = 4 if w.quick else 24
    rates = []
    for mode, name in (("--backend cpu", "our rasteriser"), ("--backend gl --passes 2", "render-pass-2"), ("--backend gl --passes shader", "one shader")):
        if "gl" in mode and not machine.gl_renderer(w):
            continue
        box = "--uv box" if "passes 2" in mode else "--uv triplanar"
        command = f"emboss-render {mode} {box} --uv-scale 70 --offset 0.011 --plain --size 512 --supersample 1 --turn {frames} {every} lung.ply -o turn-%d.ppm"
        w.run(f"cd lung && {command} --stats=../stats.json")
        s = w.told()
        rates.append([name, s["triangles_drawn"] // max(1, s["pictures"]), s["pictures"] / s["seconds"]["draw"], "triplanar" if "triplanar" in box else "box"])
    page.table(("512 × 512 pixels", "triangles", "frames/s", "coordinates"), rates)
    page.claim("“in real time”", "yes, no number", f"{rates[0][2]:.0f} frames/s without a graphics card ({rates[0][0]})")

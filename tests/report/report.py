#!/usr/bin/env python3
"""Measures what report FZKA 7190 claims and writes one page per claim.

  report.py FOLDER [--build FOLDER] [--page NAME] [--quick]

Each page has the report's numbers beside ours, with its pictures; README.md there lists all. Benchmarks write their CSV
beside. $GEWEBE_SHARED is the folder of real data (else ../shared), $PYTHON a Python with peers, $BEFORE a folder of the
programs of another commit. --quick: small sizes and no benchmarks, to see that it works. What can't be shown here says "skipped" and why. Ends with status 1 where a page fails.
"""

import argparse
import os
import pathlib
import sys
import time

import changes
import deformation
import machine
import modelling
import ratios
import rendering
import work
from page import Page, Skipped, table
from workshop import Workshop

PAGES = [
    ("triangles", "Triangles better than those of marching cubes", "Figure 3-2, section 3.1.4", modelling.triangles),
    ("reduction", "Points and triangles saved", "Figure 3-3, section 3.1.4", modelling.reduction),
    ("emboss", "Three ways to emboss, and two of our own", "Figures 3-5 to 3-9, section 3.2", rendering.emboss),
    ("two-step", "Tissue that stiffens", "Figure 3-10, section 3.3.3", deformation.two_step),
    ("storage", "Size and time of a stiffness store", "72 n², section 3.3.3", deformation.storage),
    ("particles", "Particles, their density, their surface", "Figure 4-1, section 4.1", modelling.particles),
    ("cycles", "Elastodynamic cycles a second", "Figures 4-2 and 4-3, section 4.1", deformation.cycles),
    ("myoma", "Myomas on a uterus", "Figures 3-4 and 4-4, sections 3.1.5 and 4.1", modelling.myoma),
    ("antialias", "Grey values against steps", "Figures 4-5 and 4-6, section 4.1", modelling.antialias),
    ("lung", "Lungs with four textures", "Figures 4-7 and 4-8, section 4.2", rendering.lung),
    ("hybrid", "Elastodynamic and elastostatic organs in one scene", "Figure 4-9, section 4.3", deformation.hybrid),
    ("latency", "A thousand answers a second", "Beyond the report: who feels the forces", deformation.latency),
    *work.PAGES,
    *ratios.PAGES,
    *changes.PAGES,
    ("validation", "Elements judged by theory, benchmarks and an experiment", "Beyond the report: is it right?", work.validation),
]


def index(folder, machine_rows, peers, quick):
    """README.md: what all pages that are there claim."""
    lines = [
        "# The report's figures, measured again\n",
        "`make report` wrote these pages. They measure each figure of report FZKA 7190 again and compare each stage with peers. The report's machines were a Pentium III of 1 GHz and two of 500 MHz, in 2005, so growth, crossings and cost of accuracy matter more than absolute times.\n",
    ]
    if quick:
        lines.append("**Made by `QUICK=1`: sizes are small and no benchmark ran, so these numbers say nothing.**\n")
    lines += [table(("", ""), machine_rows), "## Claims\n"]
    rows = []
    for name, title, where, _ in PAGES:
        path = folder / f"{name}.md"
        if not path.exists():
            continue
        claims, seen = [], False
        for line in path.read_text().splitlines():
            seen = seen or line.startswith("|  | FZKA 7190 | Gewebe |")
            if seen and not line.startswith("|"):
                break
            if seen and not line.startswith(("|  |", "|---")):
                claims.append([cell.strip() for cell in line.strip("|").split(" | ")])
        link = f"[{title}]({name}.md), {where[0].lower() + where[1:] if where.startswith('Figure') else where}"
        rows += [[link if n == 0 else "", *claim] for n, claim in enumerate(claims or [["", "", "skipped"]])]
    lines.append(table(("page", "claim", "FZKA 7190", "Gewebe"), rows))
    lines += ["## Peers and libraries\n", table(("", "version"), peers)]
    (folder / "README.md").write_text("\n".join(lines))


def main():
    root = pathlib.Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description="Measures what report FZKA 7190 claims and writes one page per claim.")
    parser.add_argument("folder", type=pathlib.Path, help="where pages go")
    parser.add_argument("--build", type=pathlib.Path, default=root / "build/release", help="where programs and benchmarks are")
    parser.add_argument("--page", default="", help="this page alone: " + ", ".join(name for name, *_ in PAGES))
    parser.add_argument("--quick", action="store_true", help="small and without benchmarks")
    given = parser.parse_args()
    if given.page and given.page not in [name for name, *_ in PAGES]:
        parser.error(f"no page '{given.page}', expected one of {', '.join(name for name, *_ in PAGES)}")
    given.folder.mkdir(parents=True, exist_ok=True)
    folder = given.folder.resolve()
    shared = pathlib.Path(os.environ.get("GEWEBE_SHARED") or root.parent / "shared").resolve()
    about = [*machine.describe(given.build), ("measured", machine.today())]
    failed, begin = [], time.monotonic()
    for name, title, where, make in PAGES:
        if given.page not in ("", name):
            continue
        print(f"{name} … ", end="", flush=True)
        page, start, load = Page(name, title, where, folder), time.monotonic(), machine.load()
        workshop = Workshop(root, given.build, shared, given.quick, folder)
        try:
            make(workshop, page)
            word = ""
        except Skipped as why:
            page.skip(str(why))
            word = f", skipped: {why}"
        except (RuntimeError, ValueError, KeyError, StopIteration, OSError) as error:
            failed.append(name)
            page.say(f"**failed**: {type(error).__name__}: {error}")
            word = f", failed: {type(error).__name__}: {error}"
        finally:
            workshop.close()
        seconds = time.monotonic() - start
        page.write(
            f"Measured {machine.today()} on {machine.processor()}, {machine.cores()} cores, load average {load:.1f} before; the page took {seconds:.0f} s."
        )
        print(f"{seconds:.0f} s{word}", flush=True)
    index(folder, about, machine.versions(os.environ.get("PYTHON") or "/usr/bin/python3"), given.quick)
    print(f"{time.monotonic() - begin:.0f} s in all; the pages are in {folder}, README.md lists them.", flush=True)
    if failed:
        print(f"report: failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

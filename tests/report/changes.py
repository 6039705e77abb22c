"""What changed since another commit: its programs beside these, case by case, in turns."""

import os
import re
import statistics
import subprocess

import machine
import plot
from page import Skipped
from workshop import rows_of


def measured(w, page):
    """The CSV of tests/bench/two_builds.py, which stays beside the page."""
    path = page.folder / "two_builds.csv"
    before = os.environ.get("BEFORE", "")
    if w.quick:
        raise Skipped("QUICK=1 compares no builds")
    if before:
        command = [w.python, w.root / "tests/bench/two_builds.py", before, w.build, "--data", w.data, "--work", w.folder]
        done = subprocess.run(command, cwd=w.root, env=w.environment, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(" ".join(done.stderr.split()[-60:]) or "two_builds.py says nothing")
        commit = machine.output("git", "-C", before, "rev-parse", "--short=10", "HEAD") or "unknown"
        w.keep_rows("two_builds", f"{done.stdout}# before: commit {commit}\n")
    if not path.exists():
        raise Skipped("BEFORE names no folder of another commit's programs")
    content = path.read_text()
    told = dict(re.findall(r"^# (.*?): (.*)$", content, re.M))
    where = ", ".join(f"{key}: {told[key]}" for key in ("measured", "processor", "cores", "before", "Gewebe") if key in told)
    page.note = f"Measured as the pages of work say, when and where two_builds.csv tells ({where or 'nothing'})."
    return [{**row, "case": row["case"].strip('"')} for row in rows_of(content)]


def changes(w, page):
    """Their medians over ours, and what became of the results."""
    rows = measured(w, page)
    told = lambda r: f"{int(r['threads'])} thread{'s' if r['threads'] > 1 else ''}"
    lines = [(f"{r['case']}, {told(r)}", f"{r['before_ms']:,.0f} → {r['after_ms']:,.0f} ms", r["times"]) for r in rows]
    page.svg("times", plot.bars("How long the programs took before", [("times as long as now", lines, 1)]), "times as long as now")
    ratios = sorted(r["times"] for r in rows)
    page.claim("cases that take less time than before", "–", f"{sum(t > 1 for t in ratios)} of {len(ratios)}")
    page.claim("middle of all, times as long before", "–", float(statistics.median(ratios)))
    results = [r["result"] for r in rows if r["result"] != ""]
    page.claim("results that are the same bytes", "–", f"{sum(said == 'equal' for said in results)} of {len(results)}")
    page.say(
        "`tests/bench/two_builds.py` ran each case in turns with the programs of both builds, seven times; "
        "[two_builds.csv](two_builds.csv) has the medians, the script describes the cases. *Result*: the same bytes, or the largest relative difference of two numbers, or nothing where formats differ. Memory is that of the largest process."
    )
    head = ("case", "threads", "before, ms", "now, ms", "times", "processor before, ms", "now, ms", "before, MB", "now, MB", "result")
    table = []
    for case, threads, *figures, result in (r.values() for r in rows):
        result = f"differs by {result:.1e}" if isinstance(result, float) else result
        table.append([case, int(threads), *figures, result])
    page.table(head, table)


PAGES = [("changes", "Before and after", "Work of the programs in two commits", changes)]

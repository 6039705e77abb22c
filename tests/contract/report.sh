# The pages of `make report`: all of them small and without data, and one of rows that are known.
# shellcheck shell=bash disable=SC2317 # functions are called by name

report() { python3 "$GEWEBE_ROOT/tests/report/report.py" "$@"; }

# Each page of the list is there, says which machine it is of, and shows only pictures that are there and can be read.
pages_are_whole() { # FOLDER
  python3 - "$1" "$GEWEBE_ROOT/tests/report" <<'END'
import pathlib, re, sys
import xml.etree.ElementTree as tree

folder = pathlib.Path(sys.argv[1])
sys.path.insert(0, sys.argv[2])
from report import PAGES

failed, listed = [], (folder / "README.md").read_text()
for name, title, *_ in PAGES:
    text = (folder / f"{name}.md").read_text() if (folder / f"{name}.md").exists() else ""
    if not text.startswith(f"# {title}\n"):
        failed.append(f"{name}.md is absent or another page")
    if not re.search(r"Measured 20\d\d-\d\d-\d\d on .+, \d+ cores, load average [0-9.]+|Measured as the pages of work say", text):
        failed.append(f"{name}.md does not say where it was measured")
    if f"]({name}.md)" not in listed:
        failed.append(f"README.md does not list {name}.md")
    if "**failed**: " in text:
        failed.append(f"{name}.md: {text.split('**failed**: ')[1].splitlines()[0]}")
for page in folder.glob("*.md"):
    for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
        path = folder / link
        if not path.exists():
            failed.append(f"{page.name} refers to {link}, which does not exist")
        elif path.suffix == ".svg":
            tree.parse(path)
        elif path.suffix == ".png" and path.read_bytes()[:8] != b"\x89PNG\r\n\x1a\n":
            failed.append(f"{link} is no PNG")
print(*failed, sep="\n")
sys.exit(bool(failed))
END
}

test_quick_makes_every_page_without_data() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  GEWEBE_SHARED=$PWD/nothing report pages --build "$BUILD" --quick >log 2>&1 || fail 'a page fails:' "$(grep fail log)"
  pages_are_whole pages >said || fail "$(<said)"
  grep -q 'Made by .QUICK=1' pages/README.md || fail 'small pages do not say that they are'
  # What needs data says so; what was measured is what the programs say.
  grep -q '^\*skipped: the DXF of figure 4-3, no ts_liver_gallbladder_portal.dxf' pages/cycles.md || fail 'a model from nowhere'
  grep -q '^\*skipped: the real organ, no hubmap_female_reproductive.obj' pages/myoma.md || fail 'an organ from nowhere'
  metaball2vol --voxel 4.2 "$GEWEBE_ROOT/examples/pull/five.particles" | mc-opt --stats -o /dev/null 2>stats
  local nodes
  nodes=$(sed 's/.*"points":\([0-9]*\).*/\1/' stats)
  grep -q "^| nodes, springs of five particles | 920, 2,658 | $nodes, " pages/cycles.md || fail "not $nodes nodes" "$(<pages/cycles.md)"
  # The checks see a picture that is absent, a page that is, and one that failed.
  rm pages/two-step-curve.svg
  ! pages_are_whole pages >said || fail 'a picture that does not exist passes'
  printf "<svg xmlns='http://www.w3.org/2000/svg'></svg>" >pages/two-step-curve.svg
  pages_are_whole pages >said || fail "$(<said)"
  echo '**failed**: nothing' >>pages/storage.md
  ! pages_are_whole pages >said || fail 'a page that failed passes'
}

# Benchmarks of known rows: a page compares equal threads, and names of stages may hold commas.
test_page_of_known_rows() {
  mkdir build
  for program in bench_factor ffe-run; do
    printf '#!/bin/bash\n%s\n' "cat '$PWD/rows'" >build/$program
    chmod +x build/$program
  done
  cat >rows <<'END'
stage,program,rows,columns,threads,fastest_ms,median_ms,figure,unit
matrix product,BLAS,64,64,1,1,1,57.9,GFLOP/s
net, factor,gewebe,300,0,1,9,10,5,GFLOP/s
net, factor,gewebe,300,0,2,4,5,5,GFLOP/s
net, factor,CHOLMOD,300,0,1,30,40,7,MB
END
  report pages --build build --page work-factor >log 2>&1 || fail "$(<log)"
  grep -q '^| factor of a net, 300 rows, one thread | – | 10 ms on 1 thread, CHOLMOD 40 ms on 1 thread: 4 times as long |$' pages/work-factor.md ||
    fail 'other times than the rows have' "$(<pages/work-factor.md)"
  grep -v '^#' pages/factor.csv | cmp rows - || fail 'other rows than the benchmark wrote'
  grep -q '^# processor: ' pages/factor.csv || fail 'a CSV that does not say where it was measured'
  # The picture of all stages is drawn from such rows, on equal threads.
  report pages --build build --page ratios >log 2>&1 || fail "$(<log)"
  grep -q '^| factor of a net, 1 thread | CHOLMOD, 1 thread | 4 |$' pages/ratios.md || fail 'another ratio' "$(<pages/ratios.md)"
  grep -q "^| factor of a net | BLAS's matrix product | 0.0864 |$" pages/ratios.md || fail 'another fraction' "$(<pages/ratios.md)"
  # So is the page of another commit's programs, where their times stand beside it.
  cat >pages/two_builds.csv <<'END'
case,threads,before_ms,after_ms,times,before_processor_ms,after_processor_ms,before_MB,after_MB,result
"columns, 256",1,10.0,5.0,2.000,9,4,100,50,equal
"columns, 256",2,8.0,4.0,2.000,9,4,100,50,1.3e-13
"start",1,3.0,4.0,0.750,3,4,10,10,
END
  report pages --build build --page changes >log 2>&1 || fail "$(<log)"
  grep -q '^| columns, 256 | 2 | 8 | 4 | 2 | 9 | 4 | 100 | 50 | differs by 1.3e-13 |$' pages/changes.md || fail 'another case' "$(<pages/changes.md)"
  grep -q '^| cases that take less time than before | – | 2 of 3 |$' pages/changes.md || fail 'another count' "$(<pages/changes.md)"
  grep -q '^| results that are the same bytes | – | 1 of 2 |$' pages/changes.md || fail 'another count of results' "$(<pages/changes.md)"
  # A page that can't be made fails the whole; one that nobody knows is refused.
  printf '#!/bin/bash\nexit 3\n' >build/bench_factor
  local status=0
  report pages --build build --page work-factor >log 2>&1 || status=$?
  [[ $status == 1 && $(tail -1 log) == 'report: failed: work-factor' ]] || fail "status $status" "$(<log)"
  status=0
  report pages --page nobody >log 2>&1 || status=$?
  [[ $status == 2 ]] || fail "status $status for a page that nobody knows"
}

test_pages_of_the_repository_are_whole() {
  pages_are_whole "$GEWEBE_ROOT/examples/report" >said || fail "$(<said)"
  ! grep -q 'Made by .QUICK=1' "$GEWEBE_ROOT/examples/report/README.md" || fail 'the pages are small ones'
}

# What `make bench` draws: names of stages may hold commas, what a logarithm has not is left out, a CSV without such columns has no
# picture and is no fault.
test_plot_of_known_rows() {
  mkdir bin
  printf '#!/bin/bash\ncat >gnuplot.in\n' >bin/gnuplot
  chmod +x bin/gnuplot
  cat >some.csv <<'END'
stage,program,rows,columns,threads,fastest_ms,median_ms,figure,unit
net, factor,ours,300,0,1,9,10,5,GFLOP/s
net, factor,theirs,300,0,2,4,5,6,GFLOP/s
no error,ours,300,0,1,9,10,0,mm
no number,ours,300,0,1,9,10,nan,mm
zero over size,ours,300,0,1,9,10,0,mm
# processor: one
END
  PATH="$PWD/bin:$PATH" "$GEWEBE_ROOT/scripts/plot" some.csv >said 2>&1 || fail "status $?" "$(<said)"
  [[ $(<said) == some.svg && $(grep -c '^plot ' gnuplot.in) == 2 ]] || fail 'other panels' "$(<said)" "$(<gnuplot.in)"
  grep -q "^set title 'net, factor'; set ylabel 'GFLOP/s'$" gnuplot.in || fail 'another stage' "$(<gnuplot.in)"
  grep -q "using 5:6 with linespoints title 'theirs, 2 threads'$" gnuplot.in || fail 'another program' "$(<gnuplot.in)"
  printf 'operation,program,leaves\nadd,ours,3\n' >other.csv
  PATH="$PWD/bin:$PATH" "$GEWEBE_ROOT/scripts/plot" other.csv >said 2>&1 || fail "status $?" "$(<said)"
  grep -q 'other.csv has nothing to draw' said || fail "$(<said)"
}

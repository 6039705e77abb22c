"""Where a page's files are made: programs in the PATH, a folder of its own, benchmarks read as rows."""

import json
import os
import pathlib
import shutil
import statistics
import subprocess
import tempfile

import machine
from page import Skipped


class Workshop:
    """Runs what a page asks for. `quick`: everything small, to see that it works."""

    def __init__(self, root, build, shared, quick, keep):
        self.root, self.build, self.quick = pathlib.Path(root), pathlib.Path(build).resolve(), quick
        self.data = pathlib.Path(shared).resolve() / "data"
        self.keep = pathlib.Path(keep)  # where CSV of benchmarks goes
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="gewebe-report-"))
        # Examples' own Makefiles are a user's: no variable of this make may reach them.
        self.environment = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS", "PAGE", "QUICK")}
        self.environment.update(PATH=f"{self.build}:{os.environ['PATH']}", LC_ALL="C", TZ="UTC", GEWEBE_SHARED=str(shared))
        self.python = os.environ.get("PYTHON") or ("/usr/bin/python3" if os.path.exists("/usr/bin/python3") else "python3")
        self.environment["PYTHON"] = self.python

    def close(self):
        shutil.rmtree(self.folder, ignore_errors=True)

    def run(self, command, may_fail=False, folder=None):
        """A line of bash, in the folder."""
        done = subprocess.run(
            ["bash", "-eo", "pipefail", "-c", command],
            cwd=folder or self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode and not may_fail:
            raise RuntimeError(f"{command}: {(done.stderr.strip().splitlines() or ['no word'])[-1]}")
        return done

    def stats(self, command, repeats=1):
        """What a program says of its work by --stats; seconds are medians of all repeats."""
        told = []
        for _ in range(1 if self.quick else repeats):
            self.run(f"{command} --stats=stats.json")
            told.append(self.told())
        result = told[-1]
        for key in result.get("seconds", {}):
            result["seconds"][key] = statistics.median(t["seconds"].get(key, 0) for t in told)
        return result

    def told(self):
        """What stands in stats.json."""
        return json.loads((self.folder / "stats.json").read_text())

    def example(self, name, *others):
        """A copy of an example to make, with those beside it that it reads; where it is."""
        for other in (name, *others):
            shutil.copytree(
                self.root / "examples" / other,
                self.folder / other,
                dirs_exist_ok=True,
                ignore=shutil.ignore_patterns("pictures", "*.png"),
            )
        return self.folder / name

    def shared(self, name):
        """A file of the shared data. Raises Skipped."""
        if not (self.data / name).exists():
            raise Skipped(f"no {name}: scripts/data says where it comes from")
        return self.data / name

    def bench(self, program, *words):
        """Rows of a benchmark, and what it said on standard error. Raises Skipped where it is not built."""
        path = self.build / f"bench_{program}"
        if self.quick:
            raise Skipped(f"QUICK=1 runs no benchmark (bench_{program})")
        if not path.exists():
            raise Skipped(f"no bench_{program}: make report builds it")
        done = subprocess.run([path, *words], cwd=self.root, env=self.environment, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"bench_{program}: {(done.stderr.strip().splitlines() or ['no word'])[-1]}")
        self.keep_rows(program, done.stdout)
        return rows_of(done.stdout), done.stderr

    def keep_rows(self, name, content):
        """A CSV beside the pages, with what it was measured on behind it."""
        (self.keep / f"{name}.csv").write_text(content + machine.lines(self.build, self.python))


def rows_of(content):
    """A CSV as dictionaries, what is a number as such. The first column may hold commas: the name of a stage does."""
    lines = [line.split(",") for line in content.splitlines() if line and not line.startswith("#")]
    head, rows = lines[0], []
    for cells in lines[1:]:
        more = len(cells) - len(head)
        if more > 0:
            cells[: more + 1] = [",".join(cells[: more + 1])]
        row = dict(zip(head, cells))
        for key, value in row.items():
            try:
                row[key] = float(value)
            except ValueError:
                pass
        rows.append(row)
    return rows

"""The machine, the programs and libraries of a measurement, by name and version.

  machine.py BUILD

writes them as lines "# name: value", which end the CSV of a benchmark. BUILD is the folder of its programs.
"""

import datetime
import json
import os
import pathlib
import platform
import re
import subprocess
import sys

# Peers and libraries that benchmarks are linked with, by their Debian packages.
PACKAGES = {
    "OpenVDB": "libopenvdb-dev",
    "oneTBB": "libtbb-dev",
    "CHOLMOD (SuiteSparse)": "libsuitesparse-dev",
    "HDF5": "libhdf5-dev",
    "CGAL": "libcgal-dev",
    "Embree": "libembree-dev",
    "TetGen": "tetgen",
    "Mesa": "libgl1-mesa-dri",
}
# Peers that are modules of $PYTHON.
MODULES = ("vtk", "scikit-image", "pysplashsurf", "pytetwild", "taichi", "mujoco", "warp-lang", "pypardiso", "scikit-fem")


def output(*command):
    """What a command prints, nothing if it can't."""
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def processor():
    found = re.search(r"^model name\s*: (.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.M)
    model = re.search(r"^model\s*: (\d+)$", pathlib.Path("/proc/cpuinfo").read_text(), re.M)
    name = " ".join(found.group(1).split()) if found else platform.machine()
    # Virtual machines hide the name; family and model still tell it.
    return f"{name} (model {model.group(1)})" if model and re.fullmatch(r"Intel\(R\) Xeon\(R\) Processor.*", name) else name


def cores():
    return len(os.sched_getaffinity(0))


def load():
    return os.getloadavg()[0]


def blas():
    """Which library the programs that ask for BLAS get."""
    for name in ("/usr/lib/x86_64-linux-gnu/libblas.so.3", "/etc/alternatives/libblas.so.3-x86_64-linux-gnu"):
        if os.path.exists(name):
            path = os.path.realpath(name)
            version = output("dpkg-query", "-W", "-f", "${Package} ${Version}", *output("dpkg-query", "-S", path).split(":")[:1])
            return version or path
    return "none found"


def gl_renderer(workshop):
    """Who draws for OpenGL, nothing where there is no OpenGL."""
    line = "printf '0 0 0 1\\n' | metaball2vol --voxel 0.5 | mc-opt -o ball.ply && "
    line += "emboss-render --backend gl --size 8 ball.ply -o ball.ppm --stats=ball.json"
    if workshop.run(line, may_fail=True).returncode:
        return ""
    return json.loads((workshop.folder / "ball.json").read_text())["renderer"]


def module_versions(python):
    """Of those of MODULES that this Python has."""
    code = (
        "import importlib.metadata as m\n"
        f"for name in {MODULES!r}:\n"
        "    try: print(name, m.version(name))\n"
        "    except m.PackageNotFoundError:\n"
        "        try: print(name, __import__(name.replace('-', '_')).__version__)\n"
        "        except Exception: pass\n"
    )
    return dict(line.split(" ", 1) for line in output(python, "-c", code).splitlines())


def versions(python):
    """Rows of the table of peers."""
    rows = [(name, output("dpkg-query", "-W", "-f", "${Version}", package)) for name, package in PACKAGES.items()]
    rows.append(("BLAS", blas()))
    rows += [(f"{name} (Python)", version) for name, version in module_versions(python).items()]
    return [(name, version or "absent") for name, version in rows]


def today():
    return datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")


def describe(build):
    """Rows of the table of the machine."""
    memory = re.search(r"MemTotal:\s*(\d+)", pathlib.Path("/proc/meminfo").read_text())
    system = re.search(r'^PRETTY_NAME="(.*)"', pathlib.Path("/etc/os-release").read_text(), re.M)
    told = output(str(build / "ffe-run"), "--version").splitlines()
    return [
        ("processor", processor()),
        ("cores", str(cores())),
        ("memory", f"{int(memory.group(1)) / 2**20:.0f} GiB"),
        ("system", f"{system.group(1) if system else 'Linux'}, Linux {platform.release()}"),
        ("compiler", output("g++", "--version").splitlines()[0] if output("g++", "--version") else "unknown"),
        ("Gewebe", ", ".join(told[:1]) or "unknown"),
        ("kernels", next((line.split(": ", 1)[1] for line in told if line.startswith("kernels: ")), "unknown")),
    ]


def lines(build, python):
    """Of all that a measurement depends on."""
    rows = [*describe(pathlib.Path(build)), *versions(python), ("measured", today())]
    return "".join(f"# {name}: {value}\n" for name, value in rows)


if __name__ == "__main__":
    print(lines(sys.argv[1], os.environ.get("PYTHON") or sys.executable), end="")

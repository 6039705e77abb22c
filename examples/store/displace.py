#!/usr/bin/env python3
"""u = C f from the columns of a stiffness store: displace.py [--at NODE] STORE OBJECT NODE FX FY FZ [NODE FX FY FZ ...]

Prints the displacement (mm) of each node, or of one alone, under forces (1e-6 N) at nodes that have columns, compressed
or not. Of a solid whose columns have rows for its surface these are the surface's nodes.
"""
import sys
import h5py
import numpy


def plain(group, load):
    """The sum of columns: group columns of stiffness_store(5)."""
    place = {node: k for k, node in enumerate(group["nodes"][:])}
    return sum(force @ group["values"][place[node]].astype(float) for node, force in load.items())


def compressed(group, load):
    """The sum over blocks of C between clusters of nodes: group compressed of stiffness_store(5)."""
    order, first, count = (group[name][:].astype(int) for name in ("order", "first", "count"))
    clusters, chunks = len(first) - 1, int(group.attrs["chunks"])
    axes = [(3 * order[first[c] : first[c + 1], None] + range(3)).ravel() for c in range(clusters)]
    f = numpy.zeros(3 * len(order))
    for node, force in load.items():
        if node not in order[: first[chunks]]:
            raise KeyError(node)
        f[3 * node : 3 * node + 3] = force
    u = numpy.zeros_like(f)
    data, at, counts = group["values"][:].tobytes(), 0, iter(count.reshape(-1, 2))
    for a in range(chunks):
        blocks = []
        for b in range(a, clusters):
            wide, narrow = next(counts)
            rows, columns = len(axes[a]), len(axes[b])
            blocks.append((b, wide, narrow, rows * (rows + 1) // 2 if a == b else rows + columns))
        arrays = []
        for kind, numbers in (
            ("<f8", sum(w + n for _, w, n, _ in blocks)),
            ("<i2", sum(w * size for _, w, _, size in blocks)),
            ("<i1", sum(n * size for _, _, n, size in blocks)),
        ):
            arrays.append(numpy.frombuffer(data, kind, numbers, at).astype(float))
            at += numbers * numpy.dtype(kind).itemsize
        scales, wides, narrows = arrays
        for b, wide, narrow, size in blocks:
            scale, scales = numpy.split(scales, [wide + narrow])
            int16, wides = numpy.split(wides, [wide * size])
            int8, narrows = numpy.split(narrows, [narrow * size])
            kept = numpy.concatenate((int16, int8)).reshape(wide + narrow, size)
            rows = len(axes[a])
            if a == b:
                block = numpy.zeros((rows, rows))
                block[numpy.tril_indices(rows)] = scale @ kept
                block += numpy.tril(block, -1).T
                u[axes[a]] += block @ f[axes[a]]
            else:
                block = (scale[:, None] * kept[:, :rows]).T @ kept[:, rows:]
                u[axes[b]] += f[axes[a]] @ block
                u[axes[a]] += block @ f[axes[b]]
    return u


words = sys.argv[1:]
at = int(words[1]) if words[0] == "--at" else None
store, name, *numbers = words if at is None else words[2:]
load = {}
for k in range(0, len(numbers), 4):
    load[int(numbers[k])] = numpy.array(numbers[k + 1 : k + 4], float)
stiffness = h5py.File(store, "r")[name]
kind = "compressed" if "compressed" in stiffness else "columns"
u = (compressed if kind == "compressed" else plain)(stiffness[kind], load).reshape(-1, 3)
for x, y, z in u if at is None else u[at : at + 1]:
    print(repr(float(x)), repr(float(y)), repr(float(z)))

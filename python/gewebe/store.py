"""Stiffness stores of stiffness_store(5), by h5py."""
import numpy

from .errors import Error
from .hdf5 import File


class Store(File):
    """A store, open for reading: a mapping from names of objects to their Stiffness. A context manager."""

    def __init__(self, path):
        super().__init__(path, 'gewebe stiffness store', 'stiffness store')

    def __iter__(self):
        return iter(self.file)

    def __len__(self):
        return len(self.file)

    def __getitem__(self, name):
        return Stiffness(self.file[name])


class Stiffness:
    """Stiffness of one object. group is its group in the file."""

    def __init__(self, group):
        self.group = group

    @property
    def matrix(self):
        """K as (p, i, x, axis): the lower triangle by columns, views of the file."""
        k = self.group['K']
        return k['p'][:], k['i'][:], k['x'][:], k['axis'][:]

    def nodes(self):
        """Nodes with columns, ascending."""
        if 'compressed' in self.group:
            columns = self.group['compressed']
            touched = int(columns['first'][int(columns.attrs['chunks'])])
            return numpy.sort(columns['order'][:touched].astype(int))
        return self.group['columns']['nodes'][:] if 'columns' in self.group else numpy.empty(0, int)

    def displacement(self, load):
        """u = C f, [n, 3] in mm, for forces in 1e-6 N: a dictionary from nodes with columns to x, y, z.

        n is the number of surface nodes if columns have rows for the surface alone.
        """
        missing = sorted(set(load) - set(self.nodes().tolist()))
        if missing:
            raise Error(f'{self.group.name[1:]}: node {missing[0]} has no column')
        load = {node: numpy.asarray(force, float) for node, force in load.items()}
        group = self.group
        u = _compressed(group['compressed'], load) if 'compressed' in group else _plain(group['columns'], load)
        return u.reshape(-1, 3)


def _plain(group, load):
    """The sum of columns: group columns of stiffness_store(5)."""
    place = {node: k for k, node in enumerate(group['nodes'][:])}
    u = numpy.zeros(group['values'].shape[2])
    for node, force in load.items():
        u = u + force @ group['values'][place[node]].astype(float)
    return u


def _compressed(group, load):
    """The sum over blocks of C between clusters of nodes: group compressed of stiffness_store(5)."""
    order, first, count = (group[name][:].astype(int) for name in ('order', 'first', 'count'))
    clusters, chunks = len(first) - 1, int(group.attrs['chunks'])
    axes = [(3 * order[first[c]:first[c + 1], None] + range(3)).ravel() for c in range(clusters)]
    f = numpy.zeros(3 * len(order))
    for node, force in load.items():
        f[3 * node:3 * node + 3] = force
    u = numpy.zeros_like(f)
    data, at, counts = group['values'][:].tobytes(), 0, iter(count.reshape(-1, 2))
    for a in range(chunks):
        blocks = []
        for b in range(a, clusters):
            wide, narrow = next(counts)
            rows, columns = len(axes[a]), len(axes[b])
            blocks.append((b, wide, narrow, rows * (rows + 1) // 2 if a == b else rows + columns))
        arrays = []
        for kind, numbers in (
            ('<f8', sum(w + n for _, w, n, _ in blocks)),
            ('<i2', sum(w * size for _, w, _, size in blocks)),
            ('<i1', sum(n * size for _, _, n, size in blocks)),
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

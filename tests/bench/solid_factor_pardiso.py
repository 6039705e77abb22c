"""Factorises a symmetric positive definite matrix with MKL's PARDISO, by METIS's order, and solves with it.

Usage: solid_factor_pardiso.py FILE THREADS   Prints ms of order, of factor (of the processor on one thread), operations,
MB of L, MB of memory above what the matrix takes (by its own account), backward error of a solution. FILE: rows and
entries (uint64), starts of columns and rows of entries (int64), the entries (double): lower triangle by columns, the
diagonal first. Status 3 if there is no pypardiso.
"""

import os
import sys
import time

path, threads = sys.argv[1], sys.argv[2]
os.environ["MKL_NUM_THREADS"] = threads
os.environ["MKL_DYNAMIC"] = "FALSE"
try:
    import numpy
    import pypardiso
    import scipy.sparse
except ImportError:
    sys.exit(3)

DIRECT = {1: 1, 2: 2, 10: 8, 18: -1, 19: -1}  # iparm: none by default; METIS; pivots; tell entries and operations


def main():
    with open(path, "rb") as file:
        rows, entries = map(int, numpy.fromfile(file, numpy.uint64, 2))
        start = numpy.fromfile(file, numpy.int64, rows + 1)
        row = numpy.fromfile(file, numpy.int64, entries)
        value = numpy.fromfile(file, numpy.float64, entries)
    upper = scipy.sparse.csr_matrix((value, row, start), shape=(rows, rows))  # by symmetry
    solver = pypardiso.PyPardisoSolver(mtype=2)
    for place, number in DIRECT.items():
        solver.set_iparm(place, number)
    clock = time.process_time if threads == "1" else time.perf_counter
    f = numpy.asfortranarray((numpy.arange(rows) * 7 % 23 - 11.0))

    def phase(number):
        solver.set_phase(number)
        begin = clock()
        x = solver._call_pardiso(upper, f)
        return x, 1000 * (clock() - begin)

    order, factor = phase(11)[1], phase(22)[1]
    x = phase(33)[0]
    strict = scipy.sparse.triu(upper, 1, format="csr")
    size = numpy.abs(upper) @ numpy.ones(rows) + numpy.abs(strict.T) @ numpy.ones(rows)
    left = numpy.abs(upper @ x + strict.T @ x - f).max()
    error = left / (size.max() * numpy.abs(x).max() + numpy.abs(f).max())
    told = [int(solver.get_iparm(place)) for place in (15, 16, 17, 18, 19)]
    memory = max(told[0], told[1] + told[2]) * 1024e-6
    print(order, factor, told[4] * 1e6, told[3] * 8e-6, memory, error)


main()

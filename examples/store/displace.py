#!/usr/bin/env python3
"""u = C f from the columns of a stiffness store: displace.py [--at NODE] STORE OBJECT NODE FX FY FZ [NODE FX FY FZ ...]

Prints the displacement (mm) of each node, or of one alone, under forces (1e-6 N) at nodes that have columns, compressed
or not. Of a solid whose columns have rows for its surface these are the surface's nodes. How columns are read stands in
the module gewebe, python/gewebe/store.py; it is in the wheel, or found by PYTHONPATH.
"""
import sys

import gewebe

words = sys.argv[1:]
at = int(words[1]) if words[0] == "--at" else None
store, name, *numbers = words if at is None else words[2:]
load = {}
for k in range(0, len(numbers), 4):
    load[int(numbers[k])] = [float(word) for word in numbers[k + 1 : k + 4]]
with gewebe.Store(store) as file:
    u = file[name].displacement(load)
for x, y, z in u if at is None else u[at : at + 1]:
    print(repr(float(x)), repr(float(y)), repr(float(z)))

#!/usr/bin/env python3
"""u = C f from the columns of a stiffness store: displace.py STORE OBJECT NODE FX FY FZ [NODE FX FY FZ ...]"""
import sys
import h5py
import numpy

store, name, load = sys.argv[1], sys.argv[2], sys.argv[3:]
columns = h5py.File(store, "r")[name]["columns"]
place = {node: k for k, node in enumerate(columns["nodes"][:])}
u = 0
for at in range(0, len(load), 4):
    node, force = int(load[at]), numpy.array(load[at + 1 : at + 4], float)
    u = u + force @ columns["values"][place[node]].astype(float)
for x, y, z in u.reshape(-1, 3):
    print(repr(float(x)), repr(float(y)), repr(float(z)))

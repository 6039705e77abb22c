#!/usr/bin/env python3
"""Solves a hyperelastic solid of linear tetrahedra by FElupe, on one thread, by Newton's method in steps of the load.

Usage: peer_felupe.py FOLDER neo-hookean|mooney-rivlin|yeoh|ogden MU K P1 P2 P3 STEPS

FOLDER holds points.f64, tetrahedra.u32, fixed.u8 and load.f64 as raw arrays (tests/validate/peers.cpp writes them) and takes the
displacements, u.f64. P1 to P3 are the parameters of lib/model/hyperelastic_law.h, relative to the shear modulus MU; all laws are
in modified invariants, with K/2 (J - 1)² for the volume; neo-hookean is yeoh without parameters. Prints unknowns, ms of the
processor for all of it, and the iterations.
"""
import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[name] = "1"
import felupe
import numpy as np
import scipy.sparse.linalg

folder, law = sys.argv[1:3]
mu, bulk, p1, p2, p3 = (float(word) for word in sys.argv[3:8])
steps = int(sys.argv[8])


def read(name, kind, width=1):
    values = np.fromfile(f"{folder}/{name}.{kind}", dtype={"f64": "f8", "u32": "u4", "u8": "u1"}[kind])
    return values.reshape(-1, width) if width > 1 else values


def material():
    if law == "neo-hookean":
        return felupe.NeoHooke(mu=mu, bulk=bulk)
    if law == "mooney-rivlin":
        part = felupe.Hyperelastic(felupe.mooney_rivlin, C10=mu / 2 - p1 * mu, C01=p1 * mu)
    elif law == "yeoh":
        part = felupe.Hyperelastic(felupe.yeoh, C10=mu / 2, C20=p1 * mu, C30=p2 * mu)
    else:  # FElupe's energy is 2 mu / alpha² times the sum, as ours
        part = felupe.Hyperelastic(felupe.ogden, mu=[(1 - p3) * mu, p3 * mu], alpha=[p1, p2])
    return part & felupe.Volumetric(bulk=bulk)


started = time.process_time()
mesh = felupe.Mesh(read("points", "f64", 3), read("tetrahedra", "u32", 4).astype(np.int64), "tetra")
displacement = felupe.Field(felupe.RegionTetra(mesh), dim=3)
field = felupe.FieldContainer([displacement])
solid = felupe.SolidBody(material(), field)
free = np.flatnonzero(read("fixed", "u8") == 0)
load = read("load", "f64")
iterations = 0
for step in range(1, steps + 1):
    for _ in range(50):
        left = solid.assemble.vector(field).toarray().ravel() - load * (step / steps)
        matrix = scipy.sparse.csc_matrix(solid.assemble.matrix(field))[free][:, free]
        by = scipy.sparse.linalg.spsolve(matrix, -left[free])
        values = displacement.values.ravel()
        values[free] += by
        displacement.values[:] = values.reshape(-1, 3)
        iterations += 1
        if np.abs(by).max() < 1e-12 * np.abs(values).max():
            break
    else:
        sys.exit("no convergence")
displacement.values.ravel().astype("f8").tofile(f"{folder}/u.f64")
print(free.size, 1e3 * (time.process_time() - started), iterations)

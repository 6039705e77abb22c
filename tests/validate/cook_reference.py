#!/usr/bin/env python3
"""Cook's membrane in plane strain, E = 250, nu = 0.4999: how far the upper right corner rises, by scikit-fem.

Plane Taylor-Hood elements: quadratic displacements, continuous linear pressure. At all four corners stresses are singular, so
that elements there are halved `levels` times. Sides in 8, 16, 32 with 8 levels: 7.7694, 7.77095, 7.77118 (12 levels at 16 and
more are beyond what double precision resolves).

Usage: cook_reference.py [SIDES [LEVELS]], 16 and 8 by default. Prints the rise and the number of unknowns.
"""
import os
import sys

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[name] = "1"
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg
from skfem import Basis, BilinearForm, ElementTriP1, ElementTriP2, ElementVector, FacetBasis, LinearForm, MeshTri
from skfem.helpers import ddot, div, sym_grad
from skfem.models.elasticity import lame_parameters

sides, levels = (int(sys.argv[k]) if len(sys.argv) > k else (0, 16, 8)[k] for k in (1, 2))
lam, mu = lame_parameters(250.0, 0.4999)

mesh = MeshTri.init_tensor(*2 * [np.linspace(0, 1, sides + 1)])
for level in range(levels):
    x, y = mesh.p[:, mesh.t].mean(axis=1)
    corner = np.min([np.hypot(x - a, y - b) for a in (0, 1) for b in (0, 1)], axis=0)
    mesh = mesh.refined(np.flatnonzero(corner < 0.45 * 0.5**level))
x, y = mesh.p
mesh = MeshTri(np.array([48 * x, 44 * x + (44 - 28 * x) * y]), mesh.t)

u = Basis(mesh, ElementVector(ElementTriP2()), intorder=4)
p = u.with_element(ElementTriP1())
a = BilinearForm(lambda u, v, w: 2 * mu * ddot(sym_grad(u), sym_grad(v))).assemble(u)
b = BilinearForm(lambda u, q, w: div(u) * q).assemble(u, p)
c = BilinearForm(lambda p, q, w: p * q / lam).assemble(p)
right = FacetBasis(mesh, u.elem, facets=mesh.facets_satisfying(lambda x: np.isclose(x[0], 48)))
f = np.concatenate([LinearForm(lambda v, w: 6.25 * v[1]).assemble(right), np.zeros(p.N)])
k = sp.bmat([[a, b.T], [b, -c]], format="csc")
free = np.setdiff1d(np.arange(k.shape[0]), u.get_dofs(lambda x: np.isclose(x[0], 0)).all())
found = np.zeros(k.shape[0])
found[free] = scipy.sparse.linalg.splu(k[free][:, free].tocsc()).solve(f[free])
tip = np.argmin(np.hypot(mesh.p[0] - 48, mesh.p[1] - 60))
print(found[u.nodal_dofs[1, tip]], free.size)

#!/usr/bin/env python3
"""Solves a solid of tetrahedra by scikit-fem, on one thread, and by CHOLMOD where scikit-sparse has it.

Usage: peer_skfem.py FOLDER linear|plain|mixed [matrix] [stress NODE]

FOLDER holds the case as raw arrays (tests/validate/peers.cpp writes them) and takes the answer, u.f64; with `matrix` also K on
all axes, its lower triangle by columns: column_start.i64, row.i64, value.f64; with `stress` also stress.f64, xx xy xz yy yz zz at a
corner: the mean of its elements, each by its own displacements there. Prints unknowns, ms of the processor for assembly,
factor and solve, and 1 if the factor is CHOLMOD's. Elements: linear; plain quadratic; quadratic with a bubble and discontinuous
linear pressure, pressure and bubble condensed (lib/fem/element.h), built here from their weak form.
"""
import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[name] = "1"
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg
import scipy.special
from skfem import Basis, BilinearForm, ElementDG, ElementTetP1, ElementTetP2, ElementVector, MeshTet
from skfem.element import ElementH1
from skfem.helpers import ddot, div, eye, sym_grad, trace
from skfem.refdom import RefTet

try:
    from sksparse.cholmod import cholesky
except ImportError:
    cholesky = None


class ElementTetBubble(ElementH1):
    """256 times the product of the barycentric coordinates."""

    interior_dofs = 1
    maxdeg = 4
    dofnames = ["b"]
    doflocs = np.array([[0.25, 0.25, 0.25]])
    refdom = RefTet

    def lbasis(self, X, i):
        x, y, z = X
        w = 1 - x - y - z
        return 256 * x * y * z * w, 256 * np.array([y * z * (w - x), x * z * (w - y), x * y * (w - z)])


def read(name, kind, width=1):
    values = np.fromfile(f"{folder}/{name}.{kind}", dtype={"f64": "f8", "u32": "u4", "u8": "u1"}[kind])
    return values.reshape(-1, width) if width > 1 else values


def block_inverse(matrix, size):
    """Of a matrix of blocks on its diagonal, whose rows are numbered block by block."""
    blocks = np.zeros((matrix.shape[0] // size, size, size))
    coo = matrix.tocoo()
    blocks[coo.row // size, coo.row % size, coo.col % size] = coo.data
    assert coo.row.size == 0 or (coo.row // size == coo.col // size).all()
    return sp.block_diag(list(np.linalg.inv(blocks)), format="csr")


def conical_product(n):
    """Points and weights for degree 2 n - 1 (Stroud; the tables of scikit-fem 12.0.2 are not exact from degree 5 on)."""
    (x, v), (y, w), (z, t) = ((lambda r: ((1 + r[0]) / 2, r[1] / 2 ** (a + 1)))(scipy.special.roots_jacobi(n, a, 0)) for a in (2, 1, 0))
    x, y, z = (a.ravel() for a in np.meshgrid(x, y, z, indexing="ij"))
    weights = np.einsum("i,j,k->ijk", v, w, t).ravel()
    return np.array([x, y * (1 - x), z * (1 - x) * (1 - y)]), weights


folder, kind = sys.argv[1:3]
points = read("points", "f64", 3)
tetrahedra = read("tetrahedra", "u32", 4).astype(np.int64)
lame = read("lame", "f64", 2)
fixed, load, given = read("fixed", "u8") != 0, read("load", "f64"), read("given", "f64")

started = time.process_time()
corners = np.unique(tetrahedra)
number = np.full(len(points), -1)
number[corners] = np.arange(corners.size)
mesh = MeshTet(points[corners].T.copy(), number[tetrahedra].T.copy())
assert (np.sort(mesh.t, axis=0) == np.sort(number[tetrahedra].T, axis=0)).all()
element = ElementTetP1() if kind == "linear" else ElementTetP2()
basis = Basis(mesh, ElementVector(element), **({"quadrature": conical_product(4)} if kind == "mixed" else {"intorder": 2}))
lam, mu = (np.ascontiguousarray(lame[:, k][:, None]) for k in range(2))


@BilinearForm
def shear(u, v, w):
    return 2 * w.mu * ddot(sym_grad(u), sym_grad(v))


@BilinearForm
def whole(u, v, w):
    e = sym_grad(u)
    return ddot(w.lam * eye(trace(e), 3) + 2 * w.mu * e, sym_grad(v))


@BilinearForm
def volume(u, q, w):
    return div(u) * q


@BilinearForm
def inverse_bulk(p, q, w):
    return p * q / w.lam


def spread(values, b):
    return np.broadcast_to(values, b.dx.shape)


if kind == "mixed":
    bubble = basis.with_element(ElementVector(ElementTetBubble()))
    pressure = basis.with_element(ElementDG(ElementTetP1()))
    moduli = {"lam": spread(lam, basis), "mu": spread(mu, basis)}

    def by_element(b):
        """Renumbers unknowns within elements: element by element."""
        order = b.element_dofs.T.ravel()
        return sp.csr_matrix((np.ones(order.size), (np.arange(order.size), order)), shape=(order.size, b.N))

    to_b, to_p = by_element(bubble), by_element(pressure)
    a_uu = shear.assemble(basis, **moduli)
    a_ub = to_b @ shear.assemble(basis, bubble, **moduli)
    a_bb = to_b @ shear.assemble(bubble, **moduli) @ to_b.T
    b_u = to_p @ volume.assemble(basis, pressure)
    b_b = to_p @ volume.assemble(bubble, pressure) @ to_b.T
    c = block_inverse(to_p @ inverse_bulk.assemble(pressure, **moduli) @ to_p.T, 4)
    k_uu, k_bu, k_bb = a_uu + b_u.T @ c @ b_u, a_ub + b_b.T @ c @ b_u, a_bb + b_b.T @ c @ b_b
    k = (k_uu - k_bu.T @ block_inverse(k_bb, 3) @ k_bu).tocsr()
else:
    k = whole.assemble(basis, lam=spread(lam, basis), mu=spread(mu, basis)).tocsr()

# From scikit-fem's numbers to ours.
ours = np.full(basis.N, -1)
for axis in range(3):
    ours[basis.nodal_dofs[axis]] = 3 * corners + axis
if kind != "linear":
    middles = read("middles", "u32", 6).astype(np.int64)
    ends = np.sort(number[tetrahedra[:, [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]]], axis=2)
    key = (ends[..., 0] * corners.size + ends[..., 1]).ravel()
    known, first = np.unique(key, return_index=True)
    edges = np.sort(mesh.edges, axis=0)
    found = np.searchsorted(known, edges[0] * corners.size + edges[1])
    assert (known[found] == edges[0] * corners.size + edges[1]).all()
    middle = middles.ravel()[first][found]
    for axis in range(3):
        ours[basis.edge_dofs[axis]] = 3 * middle + axis
assert (np.sort(ours) == np.flatnonzero(np.bincount(ours, minlength=3 * len(points)))).all()
coo = k.tocoo()
k = sp.csc_matrix((coo.data, (ours[coo.row], ours[coo.col])), shape=(3 * len(points),) * 2)
assembled = time.process_time()

free = np.flatnonzero(~fixed)
u = np.where(fixed, given, 0.0)
f = (load - k @ u)[free]
a = k[free][:, free].tocsc()
factoring = time.process_time()
if cholesky is not None:
    solver = cholesky(a, mode="supernodal")
else:
    solver = scipy.sparse.linalg.splu(a, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).solve
factored = time.process_time()
u[free] = solver(f)
solved = time.process_time()
u.tofile(f"{folder}/u.f64")
if "matrix" in sys.argv[3:]:
    lower = sp.tril(k, format="csc")
    lower.sort_indices()
    lower.indptr.astype(np.int64).tofile(f"{folder}/column_start.i64")
    lower.indices.astype(np.int64).tofile(f"{folder}/row.i64")
    lower.data.tofile(f"{folder}/value.f64")
if "stress" in sys.argv[3:]:
    corner = number[int(sys.argv[sys.argv.index("stress") + 1])]
    local = np.zeros(basis.N)
    local[:] = u[ours]
    at_corners = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float)
    with_corners = Basis(mesh, basis.elem, quadrature=(at_corners, np.full(4, 1 / 24)))
    grad = np.asarray(with_corners.interpolate(local).grad)  # axis, derivative, element, corner
    of_corner = np.argwhere(mesh.t.T == corner)
    stresses = []
    for t, k in of_corner:
        strain = (grad[:, :, t, k] + grad[:, :, t, k].T) / 2
        stresses.append(lame[t, 0] * np.trace(strain) * np.eye(3) + 2 * lame[t, 1] * strain)
    stress = np.mean(stresses, axis=0)
    stress[np.triu_indices(3)].tofile(f"{folder}/stress.f64")
print(free.size, *(1e3 * t for t in (assembled - started, factored - factoring, solved - factored)), int(cholesky is not None))

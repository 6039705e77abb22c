#!/usr/bin/env python3
"""Contact potentials of a surface by ipc-toolkit, on one thread.

Usage: peer_ipctk.py FOLDER

FOLDER holds the case as raw arrays (tests/validate/collision.cpp writes them): rest.f64, x.f64, start.f64 and target.f64,
positions by vertex; edges.u32, triangles.u32, owner.u32; parameters.f64: d_hat, d_min of all pairs, kappa, mu, e and 1 if
owners meet themselves. Writes gradient.f64, hessian.f64 (dense), projected.f64, friction_gradient.f64 and
friction_hessian.f64. Prints the number of pairs, energy, smallest distance, energy of friction, the additive step from x to
target that keeps half of the smallest gap, and 1 if x has intersections.
"""
import os
import sys

os.environ["OMP_NUM_THREADS"] = "1"
import ipctk
import numpy as np

ipctk.set_num_threads(1)
ipctk.set_logger_level(ipctk.LoggerLevel.off)
folder = sys.argv[1]


def read(name, kind=np.float64, width=3):
    values = np.fromfile(os.path.join(folder, name), dtype=kind)
    values = values if width is None else values.reshape(-1, width)
    return np.asfortranarray(values if kind == np.float64 else values.astype(np.int32))


def write(name, values):
    np.ascontiguousarray(values).tofile(os.path.join(folder, name))


rest, x, start, target = (read(name + ".f64") for name in ("rest", "x", "start", "target"))
edges, triangles = read("edges.u32", np.uint32, 2), read("triangles.u32", np.uint32, 3)
owner = read("owner.u32", np.uint32, None)
d_hat, d_min, kappa, mu, e, own = read("parameters.f64", width=None)
mesh = ipctk.CollisionMesh(rest, edges, triangles)
if not own:
    mesh.can_collide = ipctk.make_vertex_patches_filter(owner)
pairs = ipctk.NormalCollisions()
pairs.collision_set_type = ipctk.NormalCollisions.IPC
pairs.build(mesh, x, d_hat, d_min)
barrier = ipctk.BarrierPotential(d_hat, kappa)
none, clamp = ipctk.PSDProjectionMethod.NONE, ipctk.PSDProjectionMethod.CLAMP
write("gradient.f64", barrier.gradient(pairs, mesh, x))
write("hessian.f64", barrier.hessian(pairs, mesh, x, none).toarray())
write("projected.f64", barrier.hessian(pairs, mesh, x, clamp).toarray())
tangential = ipctk.TangentialCollisions()
tangential.build(mesh, x, pairs, barrier, mu)
friction = ipctk.FrictionPotential(e)
u = np.asfortranarray(target - start)
write("friction_gradient.f64", friction.gradient(tangential, mesh, u))
write("friction_hessian.f64", friction.hessian(tangential, mesh, u, clamp).toarray())
candidates = ipctk.Candidates()
candidates.build(mesh, x, target, d_min + d_hat)
smallest = np.sqrt(pairs.compute_minimum_distance(mesh, x))
kept = d_min + 0.5 * min(smallest - d_min, d_hat)
step = candidates.compute_collision_free_stepsize(mesh, x, target, kept, ipctk.AdditiveCCD())
print(
    len(pairs), *(repr(float(v)) for v in (barrier(pairs, mesh, x), smallest, friction(tangential, mesh, u), step)),
    int(ipctk.has_intersections(mesh, x)),
)

"""Moves a solid of linear tetrahedra by Warp's explicit stable Neo-Hookean elements, on one thread of the processor.

Usage: solid_motion_warp.py FILE YOUNG POISSON STEP STEPS EVERY
FILE as in solid_motion_mujoco.py. Weight along -z; 1 g/cm3. Prints ms of the processor for all steps, and after each EVERY steps
the mean z, in mm, of the nodes that are farthest along x. Status 3 if there is no Warp with a simulator of its own, as up to 1.9.
"""

import os
import sys
import time

out = os.dup(1)
os.dup2(2, 1)  # it greets there
try:
    import numpy
    import warp
    import warp.sim
except ImportError:
    sys.exit(3)

path, young, poisson, step, steps, every = sys.argv[1:]
young, poisson, step = float(young), float(poisson), float(step)
sizes = numpy.fromfile(path, numpy.uint64, 3).astype(int)
points = numpy.fromfile(path, numpy.float64, 3 * sizes[0], offset=24).reshape(-1, 3)
corners = numpy.fromfile(path, numpy.uint64, 4 * sizes[1], offset=24 + points.nbytes).astype(int).reshape(-1, 4)
held = numpy.fromfile(path, numpy.uint64, offset=24 + points.nbytes + 8 * corners.size).astype(int)

# Of its law the constants of small strains are these (Smith, de Goes, Kim 2018, 3.4).
shear = young / (2 * (1 + poisson))
lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
warp.init()
with warp.ScopedDevice("cpu"):
    builder = warp.sim.ModelBuilder(gravity=-9810.0, up_vector=(0.0, 0.0, 1.0))
    masses = numpy.zeros(len(points))
    volumes = abs(numpy.linalg.det(points[corners[:, 1:]] - points[corners[:, :1]])) / 6
    numpy.add.at(masses, corners.ravel(), numpy.repeat(1e-3 * volumes / 4, 4))
    masses[held] = 0  # these don't move
    for p, mass in zip(points, masses):
        builder.add_particle(p.tolist(), (0.0, 0.0, 0.0), float(mass), radius=0.0)
    for t in corners:
        builder.add_tetrahedron(*map(int, t), k_mu=4 / 3 * shear, k_lambda=lame + 5 / 6 * shear, k_damp=0.0)
    model = builder.finalize()
    model.ground = False
    model.particle_grid = None
    integrator = warp.sim.SemiImplicitIntegrator()
    now, following = model.state(), model.state()
    end = numpy.flatnonzero(points[:, 0] > points[:, 0].max() - 1e-9)
    now.clear_forces()
    integrator.simulate(model, now, following, step)  # compiles what it needs
    now, following = model.state(), model.state()
    heights, taken = [], 0.0
    for k in range(int(steps)):
        begin = time.process_time()
        now.clear_forces()
        integrator.simulate(model, now, following, step)
        now, following = following, now
        taken += time.process_time() - begin
        if (k + 1) % int(every) == 0:
            heights.append(float(now.particle_q.numpy()[end, 2].astype(float).mean()))
os.dup2(out, 1)
if not numpy.isfinite(heights).all() or numpy.abs(heights).max() > 1e3:
    sys.exit(1)  # it became unstable
print(1e3 * taken, *heights)

"""Moves a solid of linear tetrahedra by MuJoCo's flex, on one thread, contact switched off.

Usage: solid_motion_mujoco.py FILE YOUNG POISSON STEP INTEGRATOR STEPS EVERY
FILE: numbers of nodes, of tetrahedra and of held nodes (uint64), then places in mm (doubles), corners (uint64), held nodes
(uint64); INTEGRATOR: Euler, or discrete, which is implicit. Weight along -z; 1 g/cm3. Prints ms of the processor for all steps,
and after each EVERY steps the mean z, in mm, of the nodes that are farthest along x. Status 3 if there is no MuJoCo.
"""

import os
import sys
import tempfile
import time

try:
    import mujoco
    import numpy
except ImportError:
    sys.exit(3)

scratch = tempfile.TemporaryDirectory()  # it writes a log where it stands
os.chdir(scratch.name)
path, young, poisson, step, integrator, steps, every = sys.argv[1:]
sizes = numpy.fromfile(path, numpy.uint64, 3).astype(int)
points = numpy.fromfile(path, numpy.float64, 3 * sizes[0], offset=24).reshape(-1, 3) * 1e-3
corners = numpy.fromfile(path, numpy.uint64, 4 * sizes[1], offset=24 + points.nbytes).astype(int).reshape(-1, 4)
held = numpy.fromfile(path, numpy.uint64, offset=24 + points.nbytes + 8 * corners.size).astype(int)

lines = ["$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes", f"1 {len(points)} 1 {len(points)}", f"3 1 0 {len(points)}"]
lines += [str(1 + i) for i in range(len(points))]
lines += [" ".join(repr(float(x)) for x in p) for p in points]
lines += ["$EndNodes\n$Elements", f"1 {len(corners)} 1 {len(corners)}", f"3 1 4 {len(corners)}"]
lines += [" ".join(map(str, (1 + i, *(1 + t)))) for i, t in enumerate(corners)]
lines += ["$EndElements", ""]
edges = points[corners[:, 1:]] - points[corners[:, :1]]
mass = 1000 * abs(numpy.linalg.det(edges)).sum() / 6
with tempfile.NamedTemporaryFile("w", suffix=".msh") as file:
    file.write("\n".join(lines))
    file.flush()
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option gravity="0 0 -9.81" timestep="{step}" integrator="{integrator}"><flag contact="disable"/></option>
        <size memory="4000M"/><worldbody>
        <flexcomp name="body" type="gmsh" file="{file.name}" dim="3" mass="{mass}" radius="1e-4">
        <elasticity young="{young}" poisson="{poisson}" damping="0"/><contact selfcollide="none"/>
        <pin id="{' '.join(map(str, held))}"/></flexcomp></worldbody></mujoco>"""
    )
data = mujoco.MjData(model)
end = numpy.flatnonzero(points[:, 0] > points[:, 0].max() - 1e-9)
mujoco.mj_step(model, data)  # what is made once
mujoco.mj_resetData(model, data)
mujoco.mj_forward(model, data)
heights, taken = [], 0.0
for k in range(int(steps)):
    begin = time.process_time()
    mujoco.mj_step(model, data)
    taken += time.process_time() - begin
    if (k + 1) % int(every) == 0:
        mujoco.mj_kinematics(model, data)
        mujoco.mj_flex(model, data)
        heights.append(1e3 * float(data.flexvert_xpos.reshape(-1, 3)[end, 2].mean()))
print(1e3 * taken, *heights)

"""Draws a rigid sphere along a block of linear tetrahedra by MuJoCo's flex, at rest at each place, on one thread.

Usage: contact_error_mujoco.py FILE YOUNG POISSON RADIUS FRICTION STEP STIFFNESS SECONDS INTEGRATOR PLACE...
FILE: numbers of nodes, of tetrahedra and of held nodes (uint64), then places in mm (doubles), corners (uint64), held nodes
(uint64). STIFFNESS in 1/s2: of contact, damped critically. Each PLACE is "x,z" of the sphere's centre, mm: it goes there in half of
SECONDS and rests in the other half. Prints ms of the processor, and x and z of the force on the sphere at each place, 1e-6 N.
Status 3 if there is no MuJoCo.
"""

import math
import os
import sys
import tempfile
import time

try:
    import mujoco
    import numpy
except ImportError:
    sys.exit(3)

path = os.path.abspath(sys.argv[1])
young, poisson, radius, friction, step, stiffness, seconds = map(float, sys.argv[2:9])
integrator = sys.argv[9]
places = [tuple(float(x) * 1e-3 for x in word.split(",")) for word in sys.argv[10:]]
scratch = tempfile.TemporaryDirectory()  # it writes a log where it stands
os.chdir(scratch.name)
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
soft = f'solref="{-stiffness} {-2 * math.sqrt(stiffness)}" solimp="0.99 0.99 0.001" friction="{friction} 0 0"'
with open("body.msh", "w") as file:
    file.write("\n".join(lines))
model = mujoco.MjModel.from_xml_string(
    f"""<mujoco><option gravity="0 0 0" timestep="{step}" integrator="{integrator}" cone="elliptic" iterations="200" tolerance="1e-10"/>
    <size memory="4000M"/><worldbody><body name="tool" mocap="true" pos="{places[0][0]} 0 {(radius + 0.02) * 1e-3}">
    <geom type="sphere" size="{radius * 1e-3}" condim="3" {soft}/></body>
    <flexcomp name="body" type="gmsh" file="{scratch.name}/body.msh" dim="3" mass="{mass}" radius="1e-6">
    <elasticity young="{young}" poisson="{poisson}" damping="1e-2"/><contact selfcollide="none" condim="3" {soft}/>
    <pin id="{' '.join(map(str, held))}"/></flexcomp></worldbody></mujoco>"""
)
data = mujoco.MjData(model)
mujoco.mj_step(model, data)  # what is made once
mujoco.mj_resetData(model, data)
mujoco.mj_forward(model, data)


def force_on_sphere():
    """Contact forces on the sphere, N."""
    total, wrench = numpy.zeros(3), numpy.zeros(6)
    for k in range(data.ncon):
        contact = data.contact[k]
        mujoco.mj_contactForce(model, data, k, wrench)
        frame = numpy.asarray(contact.frame).reshape(3, 3)
        # From the first to the second of a pair.
        total += (1 if contact.geom[1] >= 0 else -1) * (wrench[:3] @ frame)
    return total


forces, taken, at = [], 0.0, numpy.array([places[0][0], 0, (radius + 0.02) * 1e-3])
count = max(2, round(seconds / step))
for x, z in places:
    start, to = at, numpy.array([x, 0, z])
    for k in range(count):
        at = start + min(1, 2 * (k + 1) / count) * (to - start)
        data.mocap_pos[0] = at
        begin = time.process_time()
        mujoco.mj_step(model, data)
        taken += time.process_time() - begin
    forces.append(force_on_sphere())
print(1e3 * taken, *(f"{1e6 * v!r}" for f in forces for v in (float(f[0]), float(f[2]))))

# Of an answer, gewebe_serve(5), with forces and perhaps instruments: fails where the forces of a step do not sum to zero, or
# where no step has any. Forces of loads and on nodes displaced by command would be missing in the sum; -v both=1: there are
# objects of both methods, which tell means of the step and its end, so that nothing is summed.
# Prints name and force on each object and instrument behind the last step with forces.
function add(name, x, y, z) {
  if (!(name in fx)) order[++names] = name
  fx[name] += x; fy[name] += y; fz[name] += z
  size += (x < 0 ? -x : x) + (y < 0 ? -y : y) + (z < 0 ? -z : z)
}
function clear() { split("", fx); split("", fy); split("", fz); names = size = 0; part = "" }
$1 == "step" { clear() }
$1 == "forces" { part = "forces"; object = $2; next }
$1 == "instruments" && NF == 2 { part = "instruments"; next }
$1 == "shapes" { part = ""; next }
part == "forces" && NF == 4 { add(object, $2, $3, $4) }
part == "instruments" && NF == 10 { add($1, $5, $6, $7) }
$1 == "done" && size > 0 {
  ++pushed
  x = y = z = 0
  told = ""
  for (k = 1; k <= names; ++k) {
    n = order[k]
    x += fx[n]; y += fy[n]; z += fz[n]
    told = told sprintf("%s %.6g %.6g %.6g\n", n, fx[n], fy[n], fz[n])
  }
  if (!both && !(x * x + y * y + z * z <= (1e-9 * size) ^ 2)) { print "forces sum to", x, y, z; failed = 1; exit 1 }
}
END {
  if (failed) exit 1
  if (!pushed) { print "no forces"; exit 1 }
  printf "%s", told
}

# Scores displaced nodes (CSV: x0,y0,z0,x,y,z, mm): the droops of three markers beside those measured.
#   awk -v measured='6.68 6.56 6.25' -f score.awk nodes.csv
# Markers stand 6 mm off the free end's edges, at (100, 15, 36), (100, -6, 24) and (100, 36, 6), and turn with it.
function fail(text) { print "score.awk: " text > "/dev/stderr"; failed = 1; exit 1 }
function nearest(px, py, pz, name, d) {
  d = ($column["x0"] - px) ^ 2 + ($column["y0"] - py) ^ 2 + ($column["z0"] - pz) ^ 2
  if (!(name in best) || d < best[name]) { best[name] = d; x[name] = $column["x"]; z[name] = $column["z"]; z0[name] = $column["z0"] }
}
BEGIN {
  FS = ","
  if (split(measured, is, " ") != 3) fail("measured='" measured "', expected three droops in mm")
}
FNR == 1 {
  for (k = 1; k <= NF; ++k) column[$k] = k
  if (!("x0" in column && "y0" in column && "z0" in column && "x" in column && "y" in column && "z" in column))
    fail("the heading is '" $0 "', expected x0,y0,z0,x,y,z")
  next
}
{
  nearest(100, 15, 0, "bottom"); nearest(100, 15, 30, 1)
  nearest(100, 0, 24, 2); nearest(100, 30, 6, 3)
}
END {
  if (failed) exit 1
  for (k in best)
    if (best[k] > 9) { print "score.awk: no node within 3 mm of a marker" > "/dev/stderr"; exit 1 }
  # How the end face has turned about y.
  dx = x[1] - x["bottom"]; dz = z[1] - z["bottom"]; length_ = sqrt(dx * dx + dz * dz)
  for (k = 1; k <= 3; ++k) {
    droop = z0[k] - z[k] + (k == 1 ? 6 * (1 - dz / length_) : 0)
    printf "marker %d: %.2f mm, measured %.2f mm, %+.1f %%\n", k - 1, droop, is[k], 100 * (droop / is[k] - 1)
    sum += droop / is[k] - 1; most = (droop / is[k] - 1) ^ 2 > most ? (droop / is[k] - 1) ^ 2 : most
  }
  printf "mean %+.1f %%, largest %.1f %%\n", 100 * sum / 3, 100 * sqrt(most)
}

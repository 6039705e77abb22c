# Scores displaced nodes (CSV: x0,y0,z0,x,y,z, mm): how far the middle of the free end is from where it was measured.
BEGIN { FS = ","; measured_x = 0; measured_y = -116.25; measured_z = 128.0 }
FNR == 1 {
  for (k = 1; k <= NF; ++k) column[$k] = k
  if (!("x0" in column && "y0" in column && "z0" in column && "x" in column && "y" in column && "z" in column)) {
    print "score.awk: the heading is '" $0 "', expected x0,y0,z0,x,y,z" > "/dev/stderr"; failed = 1; exit 1
  }
  next
}
{
  d = $column["x0"] ^ 2 + $column["y0"] ^ 2 + ($column["z0"] - 182) ^ 2
  if (best == "" || d < best) { best = d; x = $column["x"]; y = $column["y"]; z = $column["z"] }
}
END {
  if (failed) exit 1
  if (best == "" || best > 1) { print "score.awk: no node within 1 mm of (0, 0, 182)" > "/dev/stderr"; exit 1 }
  printf "tip %.2f %.2f %.2f mm, measured %.2f %.2f %.2f mm\n", x, y, z, measured_x, measured_y, measured_z
  printf "distance %.2f mm\n", sqrt((x - measured_x) ^ 2 + (y - measured_y) ^ 2 + (z - measured_z) ^ 2)
}

# OBJ to the faces seen from the front (from +y): depth x1 z1 x2 z2 x3 z3.
/^v / { n++; x[n] = -$2; y[n] = $3; z[n] = $4 }
/^f / {
  for (c = 2; c <= 4; ++c) sub(/\/.*/, "", $c)
  a = $2; b = $3; c = $4
  if ((x[b] - x[a]) * (z[c] - z[a]) - (x[c] - x[a]) * (z[b] - z[a]) > 0)
    printf "%.4f %.3f %.3f %.3f %.3f %.3f %.3f\n", y[a] + y[b] + y[c], x[a], z[a], x[b], z[b], x[c], z[c]
}

# Lines of best fit of the columns 3 and 4 over column 2, for each value of column 1.
function fit(what, y, xy, yy,   slope, intercept, r) {
  slope = (count * xy - sx * y) / (count * sxx - sx * sx)
  intercept = (y - slope * sx) / count
  r = (count * xy - sx * y)
  r = r * r / ((count * sxx - sx * sx) * (count * yy - y * y))
  printf "%s,%s,%.4f,%.4f,%.6f\n", what, dim, slope, intercept, r
}
function finish() {
  if (count) {
    fit("points", p, xp, pp)
    fit("triangles", t, xt, tt)
  }
  count = sx = sxx = p = xp = pp = t = xt = tt = 0
}
BEGIN { print "of,dim,slope,intercept,r2" }
NR == 1 { next }
$1 != dim { finish(); dim = $1 }
{
  ++count
  sx += $2; sxx += $2 * $2
  p += $3; xp += $2 * $3; pp += $3 * $3
  t += $4; xt += $2 * $4; tt += $4 * $4
}
END { finish() }

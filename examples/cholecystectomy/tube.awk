# Particles for tubes: awk -f tube.awk FILE. Each line of FILE is a point of a tube's middle, x y z and the radius there, in mm; a
# blank line ends a tube, # begins a comment. Between the points the middle and the radius follow Catmull and Rom's spline.
#
# Particles of radius R = 2.2 r stand 0.4 r apart. Their weight is such that where the tube is straight the density at the
# distance r is 0.5, the isovalue.

function density(d, R,    t) { t = d * d / (R * R); return t < 1 ? (1 - t) ^ 2 * (1 - 4 * t / 9) : 0 }

function spline(a, b, c, d, u) { return 0.5 * (2 * b + (c - a) * u + (2 * a - 5 * b + 4 * c - d) * u * u + (3 * b - a - 3 * c + d) * u ^ 3) }

function emit_tube(    k, i, u, steps, length_, a, p, at, since, last) {
  for (a = 1; a <= 4; ++a) { # the ends count twice
    point[0, a] = 2 * point[1, a] - point[2, a]
    point[points + 1, a] = 2 * point[points, a] - point[points - 1, a]
  }
  since = 0.4 * point[1, 4]
  for (k = 1; k < points; ++k)
    for (i = 0; i < 200; ++i) {
      u = i / 200
      for (a = 1; a <= 4; ++a) at[a] = spline(point[k - 1, a], point[k, a], point[k + 1, a], point[k + 2, a], u)
      if (k > 1 || i > 0) since += sqrt((at[1] - last[1]) ^ 2 + (at[2] - last[2]) ^ 2 + (at[3] - last[3]) ^ 2)
      for (a = 1; a <= 3; ++a) last[a] = at[a]
      if (since < 0.4 * at[4]) continue
      since -= 0.4 * at[4]
      printf "%.4f %.4f %.4f %.4f %.5f\n", at[1], at[2], at[3], 2.2 * at[4], weight
    }
  points = 0
}

BEGIN {
  sum = 0
  for (k = -6; k <= 6; ++k) sum += density(sqrt(1 + 0.16 * k * k), 2.2)
  weight = 0.5 / sum
}
{ sub(/#.*/, "") }
NF == 4 { ++points; for (a = 1; a <= 4; ++a) point[points, a] = $a }
NF == 0 && points > 1 { emit_tube() }
END { if (points > 1) emit_tube() }

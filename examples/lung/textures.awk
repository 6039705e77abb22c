# Makes the textures of a lung, which repeat in both directions: -v what=base|detail|structure|reflection, -v size=N.
# PPM or PGM to standard output.

function random(n) { seed = (seed * 16807) % 2147483647; return seed / 2147483647 }
function smooth(t) { return t * t * (3 - 2 * t) }
# Value noise on a lattice of n x n cells, 0 to 1; `layer` names the lattice.
function noise(layer, n, x, y,   i, j, i1, j1, u, v, k) {
  x *= n; y *= n
  i = int(x) % n; j = int(y) % n; i1 = (i + 1) % n; j1 = (j + 1) % n
  u = smooth(x - int(x)); v = smooth(y - int(y))
  if (!((layer, 0, 0) in lattice))
    for (k = 0; k < n * n; ++k) lattice[layer, int(k / n), k % n] = random()
  return (lattice[layer, j, i] * (1 - u) + lattice[layer, j, i1] * u) * (1 - v) + \
         (lattice[layer, j1, i] * (1 - u) + lattice[layer, j1, i1] * u) * v
}
function cloud(layer, n, x, y) {
  return 0.5 * noise(layer "a", n, x, y) + 0.27 * noise(layer "b", 2 * n, x, y) + 0.15 * noise(layer "c", 4 * n, x, y) + \
         0.08 * noise(layer "d", 8 * n, x, y)
}
# Lobules: distances f1, f2 to the two nearest of n x n shaken points, in cells.
function lobules(layer, n, x, y,   i, j, ci, cj, dx, dy, d, k) {
  if (!((layer, "x", 0, 0) in lattice))
    for (k = 0; k < n * n; ++k) {
      lattice[layer, "x", int(k / n), k % n] = 0.12 + 0.76 * random()
      lattice[layer, "y", int(k / n), k % n] = 0.12 + 0.76 * random()
    }
  x *= n; y *= n
  f1 = f2 = 9
  for (j = int(y) - 1; j <= int(y) + 1; ++j)
    for (i = int(x) - 1; i <= int(x) + 1; ++i) {
      ci = (i + n) % n; cj = (j + n) % n
      dx = i + lattice[layer, "x", cj, ci] - x; dy = j + lattice[layer, "y", cj, ci] - y
      d = sqrt(dx * dx + dy * dy)
      if (d < f1) { f2 = f1; f1 = d } else if (d < f2) f2 = d
    }
}
function clamp(v) { return v < 0 ? 0 : v > 1 ? 1 : v }
function put(r, g, b) { printf "%d %d %d\n", 255 * clamp(r) + 0.5, 255 * clamp(g) + 0.5, 255 * clamp(b) + 0.5 }
function glow(x, y, cx, cy, w, h,   d) { d = (x - cx) ^ 2 / w ^ 2 + (y - cy) ^ 2 / h ^ 2; return exp(-d) }

BEGIN {
  seed = 4711
  if (!size) size = 256
  print (what == "structure" ? "P2" : "P3"), size, size, (what == "structure" ? 65535 : 255)
  for (row = 0; row < size; ++row)
    for (column = 0; column < size; ++column) {
      x = (column + 0.5) / size; y = (row + 0.5) / size
      if (what == "base") { # pink, darker where blood stands, grey where years have left dust
        c = cloud("blood", 4, x, y); d = cloud("dust", 6, x, y)
        c = clamp(2.4 * (c - 0.3)); d = clamp(5 * (d - 0.58))
        put(0.72 - 0.17 * c - 0.20 * d, 0.39 - 0.16 * c - 0.08 * d, 0.365 - 0.13 * c - 0.05 * d)
      } else if (what == "detail") { # vessels, and the pale septa between lobules
        v = 1 - abs(2 * cloud("vessel", 5, x, y) - 1); w = 1 - abs(2 * cloud("twig", 9, x, y) - 1)
        v = v ^ 22; w = 0.5 * w ^ 16
        lobules("lobule", 11, x + 0.012 * noise("shake", 24, x, y), y + 0.012 * noise("shaken", 24, x, y))
        e = clamp(1 - 7 * (f2 - f1)); e = e * e
        put(0.13 * v + 0.08 * w + 0.07 * e, 0.010 * v + 0.005 * w + 0.065 * e, 0.02 * v + 0.01 * w + 0.06 * e)
      } else if (what == "structure") { # each lobule a dome, with finer grain
        lobules("lobule", 11, x + 0.012 * noise("shake", 24, x, y), y + 0.012 * noise("shaken", 24, x, y))
        h = clamp(1.7 * (f2 - f1)); h = 0.75 * smooth(h) * (1 - 0.2 * f1 * f1)
        lobules("acinus", 37, x, y)
        h += 0.07 * clamp(1.6 * (f2 - f1)) + 0.18 * cloud("grain", 5, x, y)
        printf "%d\n", 65535 * clamp(h) + 0.5
      } else { # what is mirrored: two lamps and their glow on the wet film, a rim of scattered light
        dx = 2 * x - 1; dy = 1 - 2 * y; rr = sqrt(dx * dx + dy * dy)
        lamp = 0.95 * glow(dx, dy, -0.30, 0.36, 0.10, 0.075) + 0.55 * glow(dx, dy, 0.34, 0.22, 0.055, 0.085)
        soft = 0.30 * glow(dx, dy, -0.28, 0.34, 0.34, 0.28) + 0.12 * glow(dx, dy, 0.3, 0.2, 0.3, 0.3)
        rim = rr > 1 ? 0 : 0.20 * clamp((rr - 0.72) / 0.28) ^ 2
        put(lamp + soft + 0.8 * rim, lamp + 0.92 * soft + 0.92 * rim, lamp + 0.9 * soft + rim)
      }
    }
}
function abs(v) { return v < 0 ? -v : v }

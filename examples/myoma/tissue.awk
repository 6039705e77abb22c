# Textures of tissue as portable anymaps in text: awk -v kind=colour|height [-v size=256] -f tissue.awk
#
# Value noise on a torus, so that the picture tiles. Its random numbers come from a generator of our own: awk's
# differ from one awk to the next.

function random() { seed = (seed * 16807) % 2147483647; return seed / 2147483647 }

# The value at (x, y) of a lattice of n x n random numbers, smoothly blended.
function noise(n, x, y,    i, j, i1, j1, u, v) {
  i = int(x); j = int(y); u = x - i; v = y - j
  u = u * u * (3 - 2 * u); v = v * v * (3 - 2 * v)
  i %= n; j %= n; i1 = (i + 1) % n; j1 = (j + 1) % n
  return (1 - v) * ((1 - u) * lattice[n, i, j] + u * lattice[n, i1, j]) + v * ((1 - u) * lattice[n, i, j1] + u * lattice[n, i1, j1])
}

function clamp(value, high) { return value < 0 ? 0 : value > high ? high : int(value + 0.5) }

BEGIN {
  if (!size) size = 256
  seed = 7190
  for (n = 4; n <= 64; n *= 2) for (i = 0; i < n; ++i) for (j = 0; j < n; ++j) lattice[n, i, j] = random()
  print (kind == "colour" ? "P3" : "P2") "\n" size, size "\n255"
  for (y = 0; y < size; ++y) {
    for (x = 0; x < size; ++x) {
      s = x / size; t = y / size
      coarse = 0.6 * noise(4, 4 * s, 4 * t) + 0.4 * noise(8, 8 * s, 8 * t)
      fine = 0.6 * noise(32, 32 * s, 32 * t) + 0.4 * noise(64, 64 * s, 64 * t)
      # A vein runs where a slow noise crosses its middle value.
      vein = noise(8, 8 * s + 2 * coarse, 8 * t + coarse) - 0.5; if (vein < 0) vein = -vein
      vein = vein < 0.04 ? 1 - vein / 0.04 : 0
      if (kind == "colour")
        print clamp(208 + 50 * (coarse - 0.5) + 22 * (fine - 0.5) - 34 * vein, 255), clamp(112 + 60 * (coarse - 0.5) + 26 * (fine - 0.5) - 40 * vein, 255), clamp(104 + 50 * (coarse - 0.5) + 24 * (fine - 0.5) - 22 * vein, 255)
      else
        print clamp(255 * (0.3 * coarse + 0.5 * fine + 0.2 * vein), 255)
    }
  }
}

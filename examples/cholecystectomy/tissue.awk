# The texture of all organs, five upright strips, as a portable anymap in text: awk -v kind=colour|height -f tissue.awk
#
# Value noise on a torus, so that it repeats upwards. Its random numbers come from a generator of our own: awk's differ from one
# awk to the next.

function random() { seed = (seed * 16807) % 2147483647; return seed / 2147483647 }

# The value at (x, y) of a lattice of n x n random numbers, smoothly blended.
function noise(n, x, y,    i, j, i1, j1, u, v) {
  i = int(x); j = int(y); u = x - i; v = y - j
  u = u * u * (3 - 2 * u); v = v * v * (3 - 2 * v)
  i %= n; j %= n; i1 = (i + 1) % n; j1 = (j + 1) % n
  return (1 - v) * ((1 - u) * lattice[n, i, j] + u * lattice[n, i1, j]) + v * ((1 - u) * lattice[n, i, j1] + u * lattice[n, i1, j1])
}

function clamp(value) { return value < 0 ? 0 : value > 255 ? 255 : int(value + 0.5) }

BEGIN {
  seed = 4309
  # Red, green, blue, and how much fine and coarse noise there is.
  split("142 62 48 24 14  126 148 84 14 26  186 178 112 8 12  206 38 32 8 14  226 158 140 18 26", look, " ")
  for (n = 4; n <= 64; n *= 2) for (i = 0; i < n; ++i) for (j = 0; j < n; ++j) lattice[n, i, j] = random()
  print (kind == "colour" ? "P3" : "P2") "\n640 256\n255"
  for (y = 0; y < 256; ++y)
    for (x = 0; x < 640; ++x) {
      s = x % 128 / 256; t = y / 256; organ = int(x / 128)
      coarse = 0.6 * noise(4, 4 * s, 4 * t) + 0.4 * noise(16, 16 * s, 16 * t) - 0.5
      fine = 0.5 * noise(32, 32 * s, 32 * t) + 0.5 * noise(64, 64 * s, 64 * t) - 0.5
      if (kind == "colour")
        print clamp(look[5 * organ + 1] + look[5 * organ + 4] * fine + look[5 * organ + 5] * coarse), \
              clamp(look[5 * organ + 2] + look[5 * organ + 4] * fine + 2 * look[5 * organ + 5] * coarse), \
              clamp(look[5 * organ + 3] + look[5 * organ + 4] * fine + look[5 * organ + 5] * coarse)
      else
        print clamp(128 + 6 * look[5 * organ + 4] * fine + 60 * coarse)
    }
}

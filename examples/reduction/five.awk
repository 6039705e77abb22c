# Five particles in the unit cube, their supports within it; -v seed=N. Park and Miller's minimal standard generator
# (1988), since rand() differs from awk to awk.
function random() {
  state = (state * 16807) % 2147483647
  return state / 2147483647
}
BEGIN {
  state = seed * 7919
  for (n = 0; n < 20; ++n) random()
  for (n = 0; n < 5; ++n) {
    radius = 0.18 + 0.12 * random()
    line = ""
    for (axis = 0; axis < 3; ++axis) line = line sprintf("%.9f ", radius + (1 - 2 * radius) * random())
    print line sprintf("%.9f", radius)
  }
}

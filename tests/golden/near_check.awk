# Of two answers side by side, gewebe_serve(5): fails where a position differs by more than 2e-4 mm or a force by more than a
# thousandth; -v positions=N -v forces=N: there are more than N coordinates, and just N forces.
function off(a, b) { return a > b ? a - b : b - a }
NF == 6 {
  for (k = 1; k < 4; ++k) { if (!(off($k, $(k + 3)) <= 2e-4)) bad = 1; ++n }
}
NF == 8 && $1 == $5 {
  for (k = 2; k < 5; ++k) { if (!(off($k, $(k + 4)) <= 1e-3 * (off($2 + $3 + $4, 0) + 1))) bad = 1; ++m }
}
END { exit !(n > positions && m == forces && !bad) }

# A block of tetrahedra as Medit .mesh: awk -v size='100 30 30' -v cells='20 6 6' -f box.awk. Six tetrahedra per cell, around its diagonal, so that
# faces of neighbours fit.
function node(i, j, k) { return 1 + i + (n[1] + 1) * (j + (n[2] + 1) * k) }
BEGIN {
  split(size, length_, " ")
  split(cells, n, " ")
  print "MeshVersionFormatted 2\nDimension 3\nVertices\n" (n[1] + 1) * (n[2] + 1) * (n[3] + 1)
  for (k = 0; k <= n[3]; ++k)
    for (j = 0; j <= n[2]; ++j)
      for (i = 0; i <= n[1]; ++i)
        print i * length_[1] / n[1], j * length_[2] / n[2], k * length_[3] / n[3], 0
  print "Tetrahedra\n" 6 * n[1] * n[2] * n[3]
  split("1 2 3  2 3 1  3 1 2  1 3 2  2 1 3  3 2 1", order, " ")
  for (k = 0; k < n[3]; ++k)
    for (j = 0; j < n[2]; ++j)
      for (i = 0; i < n[1]; ++i)
        for (path = 0; path < 6; ++path) { # from one corner to the other, an axis at a time
          at[1] = i; at[2] = j; at[3] = k
          for (step = 0; step < 4; ++step) {
            corner[step] = node(at[1], at[2], at[3])
            ++at[order[3 * path + step + 1]]
          }
          if (path < 3) print corner[0], corner[1], corner[2], corner[3], 0
          else print corner[0], corner[2], corner[1], corner[3], 0
        }
  print "End"
}

# A board of a width under z = -6, as OBJ.
BEGIN {
  for (i = 0; i < 8; i++)
    print "v", (i % 2 ? 1 : -1) * width / 2, int(i / 2) % 2 ? 95 : -95, i < 4 ? -46 : -6
  count = split("1 3 4 1 4 2 5 6 8 5 8 7 1 2 6 1 6 5 3 7 8 3 8 4 1 5 7 1 7 3 2 4 8 2 8 6", corner, " ")
  for (i = 1; i < count; i += 3)
    print "f", corner[i], corner[i + 1], corner[i + 2]
}

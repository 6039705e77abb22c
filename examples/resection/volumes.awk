# Of the skin of a model, ela_expl(5), whose triangles are of material 1 on the tumour and nowhere else: the volume of all and of the
# tumour, and how far its points are from the two planes of the knife at least: they meet in x = 79, y = 12, 40 degrees from y on
# either side.
$1 == "skin" { part = "points"; count = 0; next }
$1 == "skin_triangles" { part = "triangles"; next }
/^[a-z]/ { part = ""; next }
part == "points" { x[count] = $1; y[count] = $2; z[count] = $3; ++count }
part == "triangles" {
  six[$4] += x[$1] * (y[$2] * z[$3] - z[$2] * y[$3]) + y[$1] * (z[$2] * x[$3] - x[$2] * z[$3]) + z[$1] * (x[$2] * y[$3] - y[$2] * x[$3])
  for (k = 1; $4 == 1 && k < 4; ++k) {
    across = x[$k] > 79 ? x[$k] - 79 : 79 - x[$k]
    away = 0.642788 * (y[$k] - 12) - 0.766044 * across
    if (!margin || away < margin) margin = away
  }
}
END {
  printf "specimen %.1f ml, tumour in it %.2f ml, margin %.1f mm\n", six[0] / 6000, six[1] / 6000, margin
  exit !(margin > 0)
}

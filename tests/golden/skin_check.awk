# The volume of the skin of a model, ela_expl(5); fails where an edge is not of two triangles that run along it both ways.
$1 == "skin" { part = "points"; count = 0; next }
$1 == "skin_triangles" { part = "triangles"; next }
/^[a-z]/ { part = ""; next }
part == "points" { x[count] = $1; y[count] = $2; z[count] = $3; ++count }
part == "triangles" {
  six += x[$1] * (y[$2] * z[$3] - z[$2] * y[$3]) + y[$1] * (z[$2] * x[$3] - x[$2] * z[$3]) + z[$1] * (x[$2] * y[$3] - y[$2] * x[$3])
  ++edge[$1 " " $2]; ++edge[$2 " " $3]; ++edge[$3 " " $1]; ++triangles
}
END {
  for (e in edge) {
    split(e, end, " ")
    if (edge[e] != 1 || edge[end[2] " " end[1]] != 1) { print "edge " e " is of another number of triangles"; exit 1 }
  }
  if (!triangles) exit 1
  printf "%.9g\n", six / 6
}

# The shapes of all objects at one TIME of a text answer of ffe-run, as OBJ. Triangles are told where they change.
$1 == "step" { time = $3 }
$1 == "triangles" { count[$2] = $3; for (i = 0; i < $3 + 0; i++) { name = $2; getline line; triangle[name, i] = line } }
$1 == "shapes" && time >= TIME - 1e-9 {
  name = $2
  number = $3
  for (i = 0; i < number; i++) { getline line; print "v", line }
  for (i = 0; i < count[name]; i++) {
    split(triangle[name, i], c, " ")
    print "f", c[1] + 1 + base, c[2] + 1 + base, c[3] + 1 + base
  }
  base += number
}
$1 == "done" && time >= TIME - 1e-9 { exit }

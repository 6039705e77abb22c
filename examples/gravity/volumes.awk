# What objects have of their volume at rest where a scene ends: of their models, NAME.ela, then the text answers of ffe-run.
FNR == 1 { name = FILENAME; sub(/\.ela$/, "", name); models = FILENAME ~ /\.ela$/; if (models) order[++objects] = name }
models && /^[a-z]/ { part = $1; next }
models && part == "nodes" { put(name, nodes[name]++) }
models && part == "triangles" { corners[name, triangles[name]++] = $0 }
!models && $1 == "shapes" {
  name = $2
  count = $3
  for (i = 0; i < count; i++) {
    getline
    put(name, i)
  }
}
!models && FNR == 1 { for (k = 1; k <= objects; k++) rest[k] = volume(order[k]) }
END { for (k = 1; k <= objects; k++) printf "%-7s %6.2f %% of its volume\n", order[k] ":", 100 * volume(order[k]) / rest[k] }

function put(name, i) {
  x[name, i] = $1
  y[name, i] = $2
  z[name, i] = $3
}
function volume(name,  k, six, c, i, j, l) {
  for (k = 0; k < triangles[name]; k++) {
    split(corners[name, k], c, " ")
    i = name SUBSEP c[1]
    j = name SUBSEP c[2]
    l = name SUBSEP c[3]
    six += x[i] * (y[j] * z[l] - z[j] * y[l]) + y[i] * (z[j] * x[l] - x[j] * z[l]) + z[i] * (x[j] * y[l] - y[j] * x[l])
  }
  return six / 6
}

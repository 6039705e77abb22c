# Rest and displaced nodes side by side, from a model and the answer of `emit shapes`.
BEGIN { OFS = ","; print "x0", "y0", "z0", "x", "y", "z" }
FNR == NR { if ($1 == "nodes" && !count) count = $2; else if (count > n) rest[n++] = $1 "," $2 "," $3; next }
$1 == "shapes" { seen = 1; next }
seen && k < n { print rest[k++], $1, $2, $3 }

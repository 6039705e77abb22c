#!/bin/bash
# A ball of 30 mm with texture coordinates: longitude and height. OBJ.
exp2ela --primitive sphere:24x16 --size 30 --to obj | awk '
  $1 == "v" { print; printf "vt %.6f %.6f\n", atan2($3, $2) / 6.2831853 + 0.5, $4 / 60 + 0.5 }
  $1 == "f" { split($2, a, "/"); split($3, b, "/"); split($4, c, "/"); print "f", a[1] "/" a[1], b[1] "/" b[1], c[1] "/" c[1] }'

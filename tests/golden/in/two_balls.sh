#!/bin/bash
# A ball of 12 mm within one of 30 mm, 8 mm off its centre, as two parts of an OBJ file.
{
  echo o a
  exp2ela --primitive sphere:32x20 --size 30 --to obj
  echo o b
  exp2ela --primitive sphere:24x16 --size 12 --to obj
} | awk '
  $1 == "o" { base = points; print }
  $1 == "v" { points++; if (base) $2 += 8; print }
  $1 == "f" { for (k = 2; k < 5; ++k) { split($k, a, "/"); $k = a[1] + base } print }'

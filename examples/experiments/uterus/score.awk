# Scores forces (CSV: test,displacement,force; mm and mN) beside those measured.
function fail(text) { print "score.awk: " text > "/dev/stderr"; failed = 1; exit 1 }
BEGIN {
  FS = ","
  measured["tension", 2.12] = 16.94; measured["tension", 4.24] = 40.41; measured["tension", 6.36] = 108.25
  measured["indentation", 1.26] = 12.31
}
FNR == 1 {
  if ($0 != "test,displacement,force") fail("the heading is '" $0 "', expected test,displacement,force")
  next
}
($1, $2) in measured {
  is = measured[$1, $2]
  printf "%s %s mm: %.2f mN, measured %.2f mN, %+.1f %%\n", $1, $2, $3, is, 100 * ($3 / is - 1)
  ++n
}
END {
  if (failed) exit 1
  if (n != 4) { print "score.awk: " n + 0 " of the measured forces, expected 4" > "/dev/stderr"; exit 1 }
}

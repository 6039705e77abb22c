# Reads ELA_EXPL by its man page: awk -f ela_check.awk M.ela prints its counts; status 1 where one is wrong.
function fail(text) { print "line " NR ": " text; bad = 1; exit 1 }
{ sub(/\r$/, ""); sub(/#.*/, "") }
NF == 0 { next }
!started { if ($0 != "ela_expl 1") fail("no header"); started = 1; next }
ended { fail("text after end") }
left == 0 && $1 == "name" { next }
left == 0 && $1 == "end" { ended = 1; next }
left == 0 { # the head of a section
  if (!($1 in words) || NF != 2 || $2 !~ /^[0-9]+$/) fail("no section: " $0)
  section = $1; count[section] = left = $2; next
}
section == "tetrahedra" && (NF == 5 || NF == 11) { left--; next }
section != "materials" && NF != words[section] { fail(NF " words in " section) }
section == "springs" { kind[$3]++; if ($1 >= $2 || $2 >= count["nodes"]) fail("nodes of spring " $0) }
section == "triangles" && ($1 >= count["nodes"] || $2 >= count["nodes"] || $3 >= count["nodes"]) { fail("corner") }
{ left-- }
BEGIN { split("materials 6 nodes 8 normals 3 springs 6 triangles 3 texcoords 6 tetrahedra 5 skin 4 skin_triangles 4 skin_texcoords 6", w); for (i = 1; i < 20; i += 2) words[w[i]] = w[i + 1] }
END { if (!bad) { if (!ended) { print "no end"; exit 1 } print count["nodes"], kind["e"] + 0, kind["b"] + 0, kind["c"] + 0, count["triangles"] } }

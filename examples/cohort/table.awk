# One row an organ, of what the programs' --stats tell and the forces of its lift: awk -f table.awk NAME.told ...
function row() {
  if (organ == "") return
  if (failed != "") { print organ ",,,,,,,,," failed; return } # what stands there may be of a run before
  printf "%s,%s,%s,%s,%s,%s,%s,%s,%s,\n", organ, scaled("mc-opt volume", 1e-3), scaled("mc-opt area", 1e-2), value["exp2ela surface_nodes"],
    value["exp2ela tetrahedra"], scaled("mc-opt smallest_angle", 1), scaled("exp2ela total_mass", 1), force, seconds
}
# Where a program told nothing there is nothing.
function scaled(key, by) { return key in value ? sprintf("%.4g", value[key] * by) : "" }
BEGIN { print "organ,volume_cm3,area_cm2,surface_nodes,tetrahedra,smallest_angle,mass_g,lift_mN,seconds,failed" }
/^organ / { row(); organ = $2; seconds = 0; failed = force = ""; delete value }
/^time,object,node,/ { lift = 0; force = "0" }
/^[-+0-9.e]+,/ { split($0, part, ","); lift += part[6]; force = sprintf("%.4g", lift / 1e3) }
/^failed / { failed = substr($0, 8); gsub(/[,"]/, ";", failed) }
/^\{/ {
  match($0, /"tool":"[^"]*"/)
  tool = substr($0, RSTART + 8, RLENGTH - 9)
  for (text = $0; match(text, /"[a-z_]+":[-+0-9.e]+/); text = substr(text, RSTART + RLENGTH)) {
    split(substr(text, RSTART + 1, RLENGTH - 1), part, "\":")
    if (!((tool " " part[1]) in value)) value[tool " " part[1]] = part[2]
    if (part[1] == "total") seconds += part[2]
  }
}
END { row() }

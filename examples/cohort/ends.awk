# Between which heights the nodes of a model stand, less a part of the height at either end: awk -v ends=PART -f ends.awk MODEL.ela
$1 == "nodes" { n = $2; next }
n-- > 0 { if (low == "" || $3 < low) low = $3; if (high == "" || $3 > high) high = $3 }
END { print low + ends * (high - low), high - ends * (high - low) }

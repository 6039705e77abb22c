# Texture coordinates for an OBJ file: awk -v strip=K -f uv.awk FILE. The texture has one upright strip for each organ, from 0; its
# coordinates run to and fro within the strip, once in 60 mm, and repeat upwards.

function fro(x) { x = x / 60 - int(x / 60); if (x < 0) ++x; return x < 0.5 ? 2 * x : 2 - 2 * x }

$1 == "v" { print; printf "vt %.5f %.5f\n", (strip + 0.1 + 0.8 * fro($2 + 0.6 * $3)) / 5, ($4 + 0.7 * $3) / 60; next }
$1 == "f" { for (k = 2; k <= 4; ++k) sub(/\/.*/, "", $k); print "f", $2 "/" $2, $3 "/" $3, $4 "/" $4 }

# Heights of the nodes of two objects, a and b, must be the same.
$1 == "shapes" { who = $2; n = 0; next }
NF == 3 && who == "a" { z[++n] = $3 }
NF == 3 && who == "b" { d = $3 - z[++n]; if (!(d * d <= 1e-12)) bad = 1 }
END { exit bad || n < 10 }

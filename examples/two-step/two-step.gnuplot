# Figure 3-10; f0 and stiffer are given.
set terminal svg size 720,520 background 'white' font 'sans,13'
set datafile separator ','
set xlabel 'displacement u of the node, mm'
set ylabel 'force f, mN'
set key bottom right
set grid lc rgb '#dddddd'
set xrange [0:*]
set yrange [0:2.2 * f0 / 1e3]
u0 = real(system("awk -F, '$1 == \"first\" && $2 == " . sprintf('%d', f0) . " { print $5 }' two-step.csv"))
set arrow from 0, f0 / 1e3 to u0, f0 / 1e3 nohead dt 3 lc rgb '#888888'
set arrow from u0, 0 to u0, f0 / 1e3 nohead dt 3 lc rgb '#888888'
set label '(u0, f0)' at u0, f0 / 1e3 offset 0.6, -0.8
curve(name) = sprintf("< grep '^%s,' two-step.csv", name)
rings(name) = sprintf("< grep '^%s,' inverse.csv", name)
plot curve('first') using 5:($2 / 1e3) with lines lw 2 lc 1 title 'K1 alone', \
  curve('second') using 5:($2 / 1e3) with lines lw 2 lc 2 title sprintf('K2 alone, %g times as stiff', stiffer), \
  curve('two') using 5:($2 / 1e3) with lines lw 2 lc 7 title 'two-step, eq. 3.4', \
  curve('series') using 5:($2 / 1e3) with lines lw 2 lc 4 title 'two-step, series', \
  rings('two') using 3:($6 / 1e3) with points pt 6 lc 7 title 'displacement given, force found', \
  rings('series') using 3:($6 / 1e3) with points pt 6 lc 4 notitle

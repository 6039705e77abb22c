# Figure 3-3; dims names the sizes.
set terminal svg size 960,440 background 'white' font 'sans,13'
set datafile separator ','
set xlabel 'epsilon, voxel edges'
set xrange [0:0.5]
set yrange [0:50]
set key top left
set grid lc rgb '#dddddd'
set multiplot layout 1,2
do for [c = 3:4] {
  set ylabel (c == 3 ? 'points' : 'triangles') . ' saved, %'
  plot for [dim in dims] 'reduction.csv' using ($1 == dim + 0 ? $2 : NaN):(100 * column(c)) \
    with linespoints pt 7 ps 0.5 title dim . '³'
}
unset multiplot

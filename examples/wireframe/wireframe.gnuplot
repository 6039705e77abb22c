set terminal png size 1600,1020 truecolor linewidth 0.5 font 'sans,12'
unset key
unset border
unset tics
set size ratio -1
set style fill solid 1.0 border lc rgb '#202020'
set multiplot layout words(voxels), words(looks) margins 0.01,0.99,0.01,0.97 spacing 0.01,0.03
do for [voxel in voxels] {
  do for [look in looks] {
    set title voxel . ' mm, ' . (look eq 'plain' ? 'epsilon 0' : look eq 'snapped' ? 'epsilon 0.15' : look eq 'half' ? 'epsilon 0.5' : 'epsilon 0.15, regularized')
    plot [-75:75] [-40:75] voxel . '-' . look . '.faces' with filledcurves closed fc rgb '#f4e3dc'
  }
}
unset multiplot

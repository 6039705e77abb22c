# TetGen fills the surface of an organ with tetrahedra, without repair: an independent judge of meshes.
# shellcheck shell=bash disable=SC2317 # functions are called by name

off_of_obj() { # TetGen reads points and faces as text
  awk '
    /^v / { point[points++] = $2 " " $3 " " $4 }
    /^f / { for (c = 2; c <= 4; ++c) { sub(/\/.*/, "", $c); --$c } face[faces++] = "3 " $2 " " $3 " " $4 }
    END {
      print "OFF"; print points, faces, 0
      for (n = 0; n < points; ++n) print point[n]
      for (n = 0; n < faces; ++n) print face[n]
    }'
}

# The volume of all tetrahedra, and how many points TetGen added.
tetrahedra() { # NAME
  awk -v given="$(sed -n 2p "$1.off" | cut -d' ' -f1)" '
    /^#/ { next }
    FNR == 1 { ++file; if (file == 1) added = $1 - given; next }
    file == 1 { if (FNR == 2) first = $1; x[$1] = $2; y[$1] = $3; z[$1] = $4 }
    file == 2 {
      for (c = 3; c <= 5; ++c) { u[c] = x[$c] - x[$2]; v[c] = y[$c] - y[$2]; w[c] = z[$c] - z[$2] }
      volume = u[3] * (v[4] * w[5] - w[4] * v[5]) - v[3] * (u[4] * w[5] - w[4] * u[5]) + w[3] * (u[4] * v[5] - v[4] * u[5])
      sum += (volume < 0 ? -volume : volume) / 6
    }
    END { printf "%.9g %d\n", sum, added }' "$1.1.node" "$1.1.ele"
}

organ() { # FILE UNIT DIM
  local file=$GEWEBE_SHARED/data/$1 options volume filled added
  command -v tetgen >/dev/null || skip 'no tetgen'
  [[ -f $file ]] || skip "no $1"
  voxelize --unit "$2" --dim "$3" "$file" -o organ.vdb
  for options in '--epsilon 0.15' '--epsilon 0.5' '--epsilon 0.15 --regularize 3'; do
    # shellcheck disable=SC2086 # options are words
    mc-opt $options --stats=stats --to obj organ.vdb | off_of_obj >organ.off
    tetgen -pYQ organ.off >log 2>&1 || fail "$options: TetGen refuses the mesh:" "$(tail -3 log)"
    volume=$(sed 's/.*"volume":\([-+.e0-9]*\).*/\1/' stats)
    read -r filled added < <(tetrahedra organ)
    awk "BEGIN { exit !($filled / $volume - 1 < 1e-6 && $filled / $volume - 1 > -1e-6) }" ||
      fail "$options: tetrahedra of $filled mm³ fill $volume mm³"
    ((added == 0)) || fail "$options: TetGen needs $added points more"
  done
  # One point drawn through the body: the mesh cuts itself, and TetGen says so.
  awk 'NR == 2 { n = $1 } NR > 2 && NR <= n + 2 { x += $1; y += $2; z += $3 } { line[NR] = $0 }
    END { split(line[3], p, " "); line[3] = 2 * x / n - p[1] " " 2 * y / n - p[2] " " 3 * z / n - 2 * p[3]; for (k = 1; k <= NR; ++k) print line[k] }' organ.off >broken.off
  ! tetgen -pYQ broken.off >log 2>&1 || fail 'TetGen takes a mesh that cuts itself'
}
test_tetgen_fills_the_liver() { organ sofa_liver_smooth.obj cm 96; }
test_tetgen_fills_the_colon() { organ gca90_large_intestine_20k.stl mm 128; }

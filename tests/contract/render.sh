# Pictures: what emboss-render does where there is OpenGL and where there is none.
# shellcheck shell=bash disable=SC2317 # functions are called by name

bumps() {
  awk 'BEGIN { print "P2 32 32 255"
    for (y = -16; y < 16; ++y) for (x = -16; x < 16; ++x) { h = 1 - (x * x + y * y) / 160; print (h > 0) ? int(255 * h) : 0 } }'
}
has_gl() {
  cube >in.off
  emboss-render --plain --backend gl --size 8 in.off -o /dev/null 2>/dev/null
}
# The same for a part of a test, which is left out without it.
has_gl_too() { has_gl || { left_out 'no OpenGL'; return 1; }; }
# Largest difference of two PPMs of equal size, and how many bytes differ by more than 2.
difference() {
  python3 - "$1" "$2" <<'END'
import sys
a, b = (open(f, 'rb').read() for f in sys.argv[1:])
assert len(a) == len(b) > 100
d = [abs(x - y) for x, y in zip(a, b)]
print(max(d), sum(v > 2 for v in d))
END
}

test_without_opengl_gl_is_one_line_and_auto_a_warning() {
  local setting nowhere
  cube >in.off
  echo '{}' >empty.json
  for setting in LIBGL_DRIVERS_PATH=/nonexistent __EGL_VENDOR_LIBRARY_DIRS=/nonexistent "__EGL_VENDOR_LIBRARY_FILENAMES=$PWD/empty.json"; do
    nowhere=(env "$setting")
    # Where a driver is found all the same, this setting shows nothing.
    ! "${nowhere[@]}" emboss-render --plain --backend gl --size 8 in.off -o /dev/null 2>/dev/null || continue
    expect_failure 1 emboss-render "${nowhere[@]}" emboss-render --plain --backend gl in.off -o out.png
    [[ ! -e out.png ]] || fail 'a failure left a picture'
    "${nowhere[@]}" emboss-render --plain --size 40 in.off --to ppm -o auto.ppm 2>stderr.txt || fail 'auto failed' "$(<stderr.txt)"
    [[ $(wc -l <stderr.txt) == 1 && $(<stderr.txt) == 'emboss-render: warning: '*cpu* ]] || fail 'expected one warning' "$(<stderr.txt)"
    emboss-render --plain --backend cpu --size 40 in.off --to ppm -o cpu.ppm
    cmp auto.ppm cpu.ppm
    rm auto.ppm cpu.ppm stderr.txt
  done
}

# libepoxy would end the process; a file that is no library stands for a missing one.
test_missing_libraries_are_an_error_too() {
  cube >in.off
  mkdir none
  echo none >none/libEGL.so.1
  expect_failure 1 emboss-render env LD_LIBRARY_PATH="$PWD/none" emboss-render --plain --backend gl in.off -o out.png
  rm none/*
  echo none >none/libGL.so.1
  echo none >none/libOpenGL.so.0
  expect_failure 1 emboss-render env LD_LIBRARY_PATH="$PWD/none" emboss-render --plain --backend gl in.off -o out.png
}

test_both_backends_draw_the_same() {
  has_gl || skip 'no OpenGL'
  command -v python3 >/dev/null || skip 'no python3'
  bumps >bumps.pgm
  local options=(--structure bumps.pgm --texture bumps.pgm --color "1,0.6,0.5" --uv-scale 1 --view iso --shade 0.4 --size 200x150 --filter linear --to ppm)
  local mode max many where
  for mode in 3 2 1 shader; do
    where=vertex
    [[ $mode != shader ]] || where=pixel
    emboss-render --plain --backend gl --passes $mode --stats=stats.json "${options[@]}" in.off -o gl.ppm
    emboss-render --plain --backend cpu --tbn $where "${options[@]}" in.off -o cpu.ppm
    grep -q '"backend":"gl","platform":"[a-z ]*","renderer":"..*","target":"RGBA..F","passes":'"${mode/shader/1}" stats.json || fail 'stats do not name OpenGL' "$(<stats.json)"
    read -r max many <<<"$(difference gl.ppm cpu.ppm)"
    ((many < 300)) || fail "$many bytes differ by more than 2, at most by $max, with --passes $mode"
  done
  # That this can fail: another light.
  emboss-render --plain --backend cpu "${options[@]}" --light 1,2,30 in.off -o cpu.ppm
  read -r max many <<<"$(difference gl.ppm cpu.ppm)"
  ((many > 3000)) || fail 'another light is not seen'
}

test_programs_that_are_not_ours_read_the_pictures() {
  python3 -c 'import PIL' 2>/dev/null || skip 'no PIL for python3'
  cube >in.off
  emboss-render --plain --backend cpu --size 60x40 --view iso in.off -o out.png
  emboss-render --plain --backend cpu --size 60x40 --view iso in.off -o out.ppm
  emboss-render --plain --backend cpu --size 60x40 --view iso in.off --to rgb >out.rgb
  python3 - <<'END'
from PIL import Image
png, ppm = Image.open('out.png'), Image.open('out.ppm')
assert png.size == ppm.size == (60, 40) and png.mode == ppm.mode == 'RGB'
assert png.tobytes() == ppm.tobytes() == open('out.rgb', 'rb').read()
assert not png.info, png.info
END
}

test_shader_and_cpu_agree_on_textures_at_rest() {
  has_gl || skip 'no OpenGL'
  command -v python3 >/dev/null || skip 'no python3'
  bumps >bumps.pgm
  cube >in.off
  local look max many
  for look in '--uv triplanar --texture bumps.pgm --structure bumps.pgm --uv-scale 1' \
    '--texture veins:scale=0.7 --structure noise:scale=0.3,octaves=3'; do
    # shellcheck disable=SC2086 # several options
    emboss-render --plain --backend gl $look --view iso --size 200x150 --filter linear --to ppm in.off -o gl.ppm
    # shellcheck disable=SC2086
    emboss-render --plain --backend cpu $look --view iso --size 200x150 --filter linear --to ppm in.off -o cpu.ppm
    read -r max many <<<"$(difference gl.ppm cpu.ppm)"
    ((many < 300)) || fail "$many bytes differ by more than 2, at most by $max, with $look"
  done
  # That this can fail: another pattern.
  emboss-render --plain --backend cpu --texture veins:scale=0.7,seed=2 --view iso --size 200x150 --filter linear --to ppm in.off -o cpu.ppm
  read -r max many <<<"$(difference gl.ppm cpu.ppm)"
  ((many > 3000)) || fail 'another pattern is not seen'
}

test_what_is_not_asked_for_is_not_read() {
  cube >in.off
  bumps >bumps.pgm
  emboss-render --plain --backend cpu --size 32 --stats=stats.json in.off -o out.png
  ! grep -q surfaces_mapped stats.json || fail 'coordinates were made without a texture'
  emboss-render --plain --backend cpu --size 32 --structure bumps.pgm --stats=stats.json in.off -o out.png
  grep -q '"surfaces_mapped":1' stats.json || fail 'no coordinates were made' "$(<stats.json)"
  expect_failure 1 emboss-render emboss-render --plain --backend cpu --structure none.pgm in.off -o out.png
}

test_bumps_are_lit_from_the_side_of_the_light() {
  printf 'OFF\n4 2 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n3 0 1 2\n3 0 2 3\n' >in.off
  bumps >bumps.pgm
  # Which half of the bump in the middle of the square is the brighter one.
  brighter() {
    emboss-render --plain --backend cpu --structure bumps.pgm --uv-scale 2 --view top --color 0.5,0.5,0.5 --background 0,0,0 --size 40 --light "$1" in.off --to ppm |
      tail -c 4800 | od -An -v -tu1 -w120 | awk '{ for (i = 1; i <= 60; ++i) { l += $i; r += $(i + 60) } } END { print (l > r) ? "left" : "right" }'
  }
  [[ $(brighter -100,1,50) == left ]] || fail 'light from the left brightens the right'
  [[ $(brighter 100,1,50) == right ]] || fail 'light from the right brightens the left'
}

# A ramp that rises by a fortieth has one brightness: in 16 bits it is seen so, in 8 bits as steps.
test_heights_keep_their_16_bits() {
  local backend backends=(cpu)
  ! has_gl_too || backends+=(gl)
  printf 'OFF\n4 2 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n3 0 1 2\n3 0 2 3\n' >in.off
  shades() { # MAXVAL OPTION...
    awk -v top="$1" 'BEGIN { print "P2 256 2", top; for (n = 0; n < 512; ++n) print int(top * (0.4 + (n % 256) / 10240) + 0.5) }' >in.pgm
    emboss-render --plain "${@:2}" --structure in.pgm --wrap clamp --uv-scale 2 --offset 0.2 --view top --distance 2 --color 0.8,0.8,0.8 --size 100 --light-direction 1,0,0.1 in.off --to ppm |
      tail -c 15000 | head -c 240 | od -An -v -tu1 -w3 | sort -u | wc -l
  }
  for backend in "${backends[@]}"; do
    [[ $(shades 65535 --backend "$backend") == 1 ]] || fail "16 bits are not smooth with $backend" "$(shades 65535 --backend "$backend")"
    (($(shades 255 --backend "$backend") > 1)) || fail "8 bits are not steps with $backend, so that nothing is shown"
  done
}

# Two squares side by side, of materials 4 and 0 and of parts 0 and 1.
two_materials() {
  printf '%s\n' ply 'format ascii 1.0' 'element vertex 8' 'property double x' 'property double y' 'property double z' 'element face 4' \
    'property list uchar int vertex_indices' 'property int part' 'property int material' end_header \
    '0 0 0' '2 0 0' '2 2 0' '0 2 0' '2 0 0' '4 0 0' '4 2 0' '2 2 0' '3 0 1 2 0 4' '3 0 2 3 0 4' '3 4 5 6 1 0' '3 4 6 7 1 0'
}
test_materials_have_their_own_textures() {
  two_materials >in.ply
  printf 'P3 1 1 255 200 0 0\n' >red.ppm
  printf 'P3 1 1 255 0 0 180\n' >blue.ppm
  # The colours of the left and of the right square.
  colors() {
    emboss-render --plain --backend cpu --view top --size 40x20 --distance 4 --stats=stats.json "$@" --to ppm |
      tail -c 2400 | od -An -v -tu1 -w120 -j1200 | awk 'NR == 1 { print $31, $32, $33, $91, $92, $93 }'
  }
  [[ $(colors --texture blue.ppm --texture 4=red.ppm in.ply) == '200 0 0 0 0 180' ]] || fail 'materials' "$(colors --texture blue.ppm --texture 4=red.ppm in.ply)"
  grep -q '"triangles_by_look":\[2,2\]' stats.json || fail 'no counts' "$(<stats.json)"
  [[ $(colors --texture 0=red.ppm --texture 4=blue.ppm in.ply) == '0 0 180 200 0 0' ]] || fail 'no texture for all'
  [[ $(colors --by part --texture 1=red.ppm in.ply) == '255 255 255 200 0 0' ]] || fail 'by part'
  [[ $(colors --color 0=0,1,0 --color 0.2,0.2,0.2 --texture 4=blue.ppm in.ply) == '0 0 36 0 255 0' ]] || fail 'colours, and what is not given'
  # A model, whose materials exp2ela numbers.
  exp2ela --material 1=uterus in.ply -o in.ela
  [[ $(colors --texture 1=red.ppm --color 0=0,0,1 in.ela) == '0 0 255 200 0 0' ]] || fail 'a model' "$(colors --texture 1=red.ppm --color 0=0,0,1 in.ela)"
  emboss-render --plain --backend cpu --color 7=1,0,0 in.ply -o out.png 2>stderr.txt
  [[ $(<stderr.txt) == 'emboss-render: warning: no triangle is of material 7' ]] || fail 'a material that is not there' "$(<stderr.txt)"
  expect_failure 1 emboss-render emboss-render --plain --backend cpu --texture 0=none.ppm in.ply -o out.png
  # A texture that no triangle has is not opened.
  emboss-render --plain --backend cpu --texture 7=none.ppm in.ply -o out.png 2>stderr.txt || fail 'an unused texture was opened' "$(<stderr.txt)"
  [[ $(<stderr.txt) == 'emboss-render: warning: no triangle is of material 7' ]] || fail 'an unused texture' "$(<stderr.txt)"
  expect_failure 2 emboss-render emboss-render --texture 1= in.ply -o out.png
  expect_failure 2 emboss-render emboss-render --texture 1=red.ppm --texture 1=red.ppm in.ply -o out.png
  expect_failure 2 emboss-render emboss-render --by part in.ply -o out.png
}

# Of one material, next to others and to files; and what the shader draws of two is what the rasteriser does.
test_materials_have_their_own_textures_at_rest() {
  two_materials >in.ply
  bumps >bumps.pgm
  printf 'P3 1 1 255 200 0 0\n' >red.ppm
  # The rows of the left and of the right square, but for what is near their common edge.
  halves() {
    emboss-render --plain --backend cpu --view top --size 40x20 --distance 4 --light 5,9,9 --background 0,0,0 "$@" --to ppm | tail -c 2400 | od -An -v -tu1 -w120 >rows
    cut -c -228 rows >left
    cut -c 253- rows >right
  }
  local one='--texture veins:scale=0.7 --structure noise:scale=0.4' other='--texture noise:scale=0.5,seed=2' max many
  # shellcheck disable=SC2086 # several options
  halves $one in.ply
  mv left one
  # shellcheck disable=SC2086
  halves $other in.ply
  mv right other
  ! cmp -s left one || fail 'the two look alike, so that nothing is shown'
  # shellcheck disable=SC2086
  halves $other --texture 4=veins:scale=0.7 --structure 4=noise:scale=0.4 in.ply
  cmp left one
  cmp right other
  # shellcheck disable=SC2086
  halves $one --texture 0=noise:scale=0.5,seed=2 --structure 0=bumps.pgm --offset 0 in.ply
  cmp right other
  # A file in the place of a solid one, the other way round, and three projections next to one.
  halves --texture noise --texture 4=red.ppm in.ply
  [[ $(tr -s ' ' '\n' <left | sort -u | tr -d '\n') == 0200 ]] || fail 'a file for one material' "$(sort -u left)"
  halves --uv triplanar --texture bumps.pgm --texture 0=noise:scale=0.5,seed=2 in.ply
  cmp right other
  mv left bumpy
  halves --uv triplanar --texture bumps.pgm in.ply
  cmp left bumpy
  expect_failure 2 emboss-render emboss-render --reflection 4=noise in.ply -o out.png
  expect_failure 2 emboss-render emboss-render --structure 4=noise --offset-texels 2 in.ply -o out.png
  expect_failure 2 emboss-render emboss-render --texture 4=noise:scale=0 in.ply -o out.png
  expect_failure 2 emboss-render emboss-render --plain --backend gl --passes 2 --texture 4=noise in.ply -o out.png
  has_gl_too || return 0
  # Two that differ in nothing but their values, which share a program.
  both() { emboss-render --plain --backend "$1" --view top --size 200x100 --filter linear --texture noise:scale=0.5,seed=2 --texture "4=noise:scale=0.4,seed=$2" --to ppm in.ply -o "$1.ppm"; }
  both gl 5
  both cpu 5
  read -r max many <<<"$(difference gl.ppm cpu.ppm)"
  ((many < 300)) || fail "$many bytes differ by more than 2, at most by $max"
  both cpu 2
  read -r max many <<<"$(difference gl.ppm cpu.ppm)"
  ((many > 3000)) || fail 'another pattern is not seen'
}

# The objects of a run, each with its own.
test_objects_have_their_own_textures() {
  cube >in.off
  exp2ela in.off -o a.ela
  awk 'NR > 2 && NF == 3 { $1 += 3 } { print }' in.off >b.off
  exp2ela b.off -o b.ela
  printf '%s\n' 'object left a.ela' 'object right b.ela' step >in.scene
  ffe-run -q in.scene -o run.h5 >/dev/null
  emboss-render --plain --backend cpu --by object --color 0=1,0,0 --color 1=0,0,1 --background 0,1,0 --view top --size 60x40 --stats=stats.json run.h5 --to ppm >out.ppm
  grep -q '"triangles_by_look":\[0,12,12\]' stats.json || fail 'no counts' "$(<stats.json)"
  [[ $(tail -c 7200 out.ppm | od -An -v -tu1 -w3 | sort -u | wc -l) == 3 ]] || fail 'not two colours on a third'
}

test_it_loads_only_what_it_uses() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local libraries
  libraries=$(ldd "$BUILD/emboss-render")
  ! grep -Eq 'lib(openvdb|cholmod|mpfr|openblas)' <<<"$libraries" || fail 'it loads too much' "$libraries"
  grep -q libepoxy <<<"$libraries" || fail 'it does not load epoxy' "$libraries"
}

test_a_film_has_a_picture_for_each_frame_and_keeps_those_without_motion() {
  cube >in.off
  exp2ela in.off -o cube.ela
  printf '%s\n' 'object cube cube.ela' step step step step >in.scene
  ffe-run -q in.scene -o run.h5 >/dev/null
  emboss-render --plain --backend cpu --size 24x20 --frames all --to rgb --stats=stats.json run.h5 -o all.rgb
  local frames
  frames=$(grep -o '"pictures":[0-9]*' stats.json | cut -d: -f2)
  ((frames > 1)) || fail 'one frame is no film' "$(<stats.json)"
  grep -q '"vertex_splits":0,"frames_made":0,"vertices_made":1' stats.json || fail 'vertices were made again' "$(<stats.json)"
  grep -q "\"pictures_kept\":$((frames - 1))" stats.json || fail 'pictures were drawn again' "$(<stats.json)"
  [[ $(wc -c <all.rgb) == $((frames * 24 * 20 * 3)) ]] || fail 'another number of bytes than frames have'
  emboss-render --plain --backend cpu --size 24x20 --frames 0:-1:2 run.h5 -o 'f%03d.png'
  [[ -e f000.png && ! -e f001.png ]] || fail 'the numbers of the frames are not those of the files' ./*.png
  expect_failure 1 emboss-render emboss-render --plain --backend cpu --frames 0:99 run.h5 -o x.rgb
  expect_failure 2 emboss-render emboss-render --plain --backend cpu --frames a:b run.h5 -o x.rgb
  expect_failure 2 emboss-render emboss-render --plain --backend cpu --frames all run.h5 -o 'f%s.png'
}

# What moves decides what is made again: counts, and the same pictures as one by one.
test_a_sequence_renews_only_what_changed() {
  cube >in.off
  bumps >bumps.pgm
  exp2ela in.off -o cube.ela
  printf '%s\n' 'object cube cube.ela' step 'displace cube 0 0.1 0 0' step step >in.scene
  ffe-run -q in.scene -o run.h5 >/dev/null
  local look=(--backend cpu --structure bumps.pgm --uv-scale 1 --size 40 --view iso) frame
  counts() { grep -o '"pictures":[0-9]*,"pictures_kept":[0-9]*,"vertex_splits":[0-9]*,"frames_made":[0-9]*,"vertices_made":[0-9]*' stats.json | sed 's/"[a-z_]*"://g'; }
  emboss-render --plain "${look[@]}" --frames all --stats=stats.json run.h5 -o 'f%d.ppm'
  # Rest, a step in which nothing moved, and two in which something did.
  [[ $(counts) == 4,1,1,3,3 ]] || fail 'frames of a run' "$(counts)"
  for frame in 0 1 2 3; do
    emboss-render --plain "${look[@]}" --frame $frame run.h5 -o one.ppm
    cmp one.ppm f$frame.ppm
  done
  ! cmp -s f1.ppm f2.ppm || fail 'nothing moved, so that nothing is shown'
  # Places at rest stay with the vertices.
  emboss-render --plain --backend cpu --size 40 --view iso --texture veins:scale=0.7 --structure noise:scale=0.4 --frames all run.h5 -o 'v%d.ppm'
  for frame in 0 1 2 3; do
    emboss-render --plain --backend cpu --size 40 --view iso --texture veins:scale=0.7 --structure noise:scale=0.4 --frame $frame run.h5 -o one.ppm
    cmp one.ppm v$frame.ppm
  done
  ! cmp -s v1.ppm v2.ppm || fail 'solid textures, too: nothing moved, so that nothing is shown'
  # Another view: the frames of tangents stay; and a light that turns.
  emboss-render --plain "${look[@]}" --turn 3 --stats=stats.json cube.ela -o 't%d.ppm'
  [[ $(counts) == 3,0,1,1,1 ]] || fail 'a turn' "$(counts)"
  emboss-render --plain "${look[@]}" --orbit 120,0 --light "$(grep -o '"light":\[[^]]*' stats.json | cut -d[ -f2)" cube.ela -o one.ppm
  cmp one.ppm t1.ppm
  emboss-render --plain "${look[@]}" --turn-light 4 --stats=stats.json cube.ela --to rgb -o light.rgb
  [[ $(counts) == 4,0,1,1,1 && $(wc -c <light.rgb) == 19200 ]] || fail 'a turning light' "$(counts)"
  ! cmp -s <(head -c 4800 light.rgb) <(tail -c 4800 light.rgb) || fail 'the light does not turn'
  # By vertex the light stands at the vertices, which are made again, but not split, nor their frames.
  emboss-render --plain "${look[@]}" --tbn vertex --turn-light 4 --stats=stats.json cube.ela --to rgb -o light.rgb
  [[ $(counts) == 4,0,1,1,4 ]] || fail 'a turning light by vertex' "$(counts)"
  if has_gl_too; then
    emboss-render --plain "${look[@]:2}" --backend gl --turn 3 --stats=stats.json cube.ela --to rgb -o turn.rgb
    grep -q '"uploads":1,' stats.json || fail 'OpenGL was given the same again' "$(<stats.json)"
  fi
}

# The cut of a solid has the area that VTK finds, of planes through nodes too.
test_vtk_cuts_solids_as_we_do() {
  python3 -c 'import vtk' 2>/dev/null || skip 'no VTK for python3'
  metaball2vol --voxel 0.5 "$GEWEBE_ROOT/tests/golden/in/five.particles" | mc-opt --tets -o in.vtu
  local plane
  for plane in 2,0,-1,1,1,0.3 0,0,0,0,0,1 0,0,0,-3,0,0 0.5,-0.25,1,0.3,-1,0.7; do
    emboss-render --backend cpu --size 8 --clip=$plane --stats="$plane.json" in.vtu -o /dev/null
  done
  cat >in.py <<'END'
import glob, json, vtk
from vtk.util.numpy_support import vtk_to_numpy
reader = vtk.vtkXMLUnstructuredGridReader(); reader.SetFileName('in.vtu'); reader.Update()
def area(p):
    plane = vtk.vtkPlane(); plane.SetOrigin(*p[:3])
    plane.SetNormal(*(x / sum(y * y for y in p[3:]) ** 0.5 for x in p[3:]))
    cut = vtk.vtkCutter(); cut.SetCutFunction(plane); cut.SetInputData(reader.GetOutput())
    sizes = vtk.vtkCellSizeFilter(); sizes.SetInputConnection(cut.GetOutputPort()); sizes.Update()
    return vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray('Area')).sum()
names = glob.glob('*.json')
assert len(names) == 4
for name in names:
    ours, p = json.load(open(name))['cut_area'], [float(x) for x in name[:-5].split(',')]
    assert 100 < ours < 200 and abs(area(p) / ours - 1) < 1e-6, (name, area(p), ours)
    assert abs(area([x + 0.1 * n for x, n in zip(p, p[3:])] + p[3:]) / ours - 1) > 1e-5, 'any other plane would do'
END
  python3 in.py
}

# What is broken in a mesh gives a right picture or one clear line.
test_degenerate_input() {
  local backend backends=(cpu) many
  ! has_gl_too || backends+=(gl)
  awk 'BEGIN { print "P2 32 32 255"
    for (y = -15.5; y < 16; ++y) for (x = -15.5; x < 16; ++x) { h = 1 - (x * x + y * y) / 160; print (h > 0) ? int(255 * h) : 0 } }' >bumps.pgm
  # A square of 2 x 2; NORMAL stands at each point, ST are the coordinates of its two triangles.
  square() { # NORMAL ST ST [FACE...]
    local normal=$1 first=$2 second=$3
    shift 3
    printf '%s\n' ply 'format ascii 1.0' 'element vertex 4' 'property double x' 'property double y' 'property double z' ${normal:+'property float nx' 'property float ny' 'property float nz'} \
      "element face $((2 + $#))" 'property list uchar int vertex_indices' 'property list uchar float texcoord' end_header \
      "0 0 0 $normal" "2 0 0 $normal" "2 2 0 $normal" "0 2 0 $normal" "3 0 1 2 6 $first" "3 0 2 3 6 $second" "$@"
  }
  picture() { emboss-render --plain --backend "$backend" --structure bumps.pgm --texture bumps.pgm --view top --light 5,9,9 --size 48 "$1" -o "$2"; }
  for backend in "${backends[@]}"; do
    square '' '0 0 1 0 1 1' '0 0 1 1 0 1' >in.ply
    picture in.ply whole.ppm
    # Triangles without area in space, drawn or not, change nothing.
    square '' '0 0 1 0 1 1' '0 0 1 1 0 1' '3 1 1 2 6 0 0 1 0 1 1' '3 0 2 2 6 0 0 1 0 1 1' >in.ply
    picture in.ply area.ppm
    cmp whole.ppm area.ppm
    # Without area in the texture: one texel, flat.
    square '' '0.5 0.5 0.5 0.5 0.5 0.5' '0.5 0.5 0.5 0.5 0.5 0.5' >in.ply
    picture in.ply flat.ppm
    [[ $(tail -c 6912 flat.ppm | od -An -v -tu1 -w3 | sort -u | wc -l) == 2 ]] || fail "$backend: a texture without area is not one colour on the background"
    # Mirrored, both by the mesh and by the picture's coordinates: the light still comes from its side.
    square '' '1 0 0 0 0 1' '1 0 0 1 1 1' >in.ply
    picture in.ply mirrored.ppm
    read -r _ many <<<"$(difference whole.ppm mirrored.ppm)"
    ((many < 60)) || fail "$backend: bumps that are symmetric are not in the mirror" "$many"
    # Normals of zero count as none.
    square '0 0 0' '0 0 1 0 1 1' '0 0 1 1 0 1' >in.ply
    picture in.ply normals.ppm
    cmp whole.ppm normals.ppm
    # The light on a vertex, and the camera on the surface.
    emboss-render --plain --backend "$backend" --structure bumps.pgm --view top --light 0,0,0 --size 48 in.ply -o out.ppm
    emboss-render --plain --backend "$backend" --structure bumps.pgm --eye 1,1,0 --target 1,2,0 --size 48 in.ply -o out.ppm
    # 1 x 1, and more than there is memory for.
    emboss-render --plain --backend "$backend" --size 1 in.ply --to rgb -o out.rgb
    [[ $(wc -c <out.rgb) == 3 ]] || fail "$backend: 1 x 1 is not one pixel"
    rm -f out.png
    expect_failure 1 emboss-render emboss-render --plain --backend "$backend" --size 8000 --max-memory 50M in.ply -o out.png
    [[ ! -e out.png ]] || fail "$backend: a failure left a picture"
  done
  # Normals that are no numbers are refused by their place.
  square 'nan 0 1' '0 0 1 0 1 1' '0 0 1 1 0 1' >in.ply
  expect_failure 1 emboss-render emboss-render --plain --backend cpu in.ply -o out.png
  printf 'OFF\n3 1 0\n0 0 0\n1 0 0\nnan 1 0\n3 0 1 2\n' >in.off
  expect_failure 1 emboss-render emboss-render --plain --backend cpu in.off -o out.png
}

# Pictures: what emboss-render does where there is OpenGL and where there is none.
# shellcheck shell=bash disable=SC2317 # functions are called by name

bumps() {
  awk 'BEGIN { print "P2 32 32 255"
    for (y = -16; y < 16; ++y) for (x = -16; x < 16; ++x) { h = 1 - (x * x + y * y) / 160; print (h > 0) ? int(255 * h) : 0 } }'
}
has_gl() {
  cube >in.off
  emboss-render --backend gl --size 8 in.off -o /dev/null 2>/dev/null
}
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
    ! "${nowhere[@]}" emboss-render --backend gl --size 8 in.off -o /dev/null 2>/dev/null || continue
    expect_failure 1 emboss-render "${nowhere[@]}" emboss-render --backend gl in.off -o out.png
    [[ ! -e out.png ]] || fail 'a failure left a picture'
    "${nowhere[@]}" emboss-render --size 40 in.off --to ppm -o auto.ppm 2>stderr.txt || fail 'auto failed' "$(<stderr.txt)"
    [[ $(wc -l <stderr.txt) == 1 && $(<stderr.txt) == 'emboss-render: warning: '*cpu* ]] || fail 'expected one warning' "$(<stderr.txt)"
    emboss-render --backend cpu --size 40 in.off --to ppm -o cpu.ppm
    cmp auto.ppm cpu.ppm
    rm auto.ppm cpu.ppm stderr.txt
  done
}

# libepoxy would end the process; a file that is no library stands for a missing one.
test_missing_libraries_are_an_error_too() {
  cube >in.off
  mkdir none
  echo none >none/libEGL.so.1
  expect_failure 1 emboss-render env LD_LIBRARY_PATH="$PWD/none" emboss-render --backend gl in.off -o out.png
  rm none/*
  echo none >none/libGL.so.1
  echo none >none/libOpenGL.so.0
  expect_failure 1 emboss-render env LD_LIBRARY_PATH="$PWD/none" emboss-render --backend gl in.off -o out.png
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
    emboss-render --backend gl --passes $mode --stats=stats.json "${options[@]}" in.off -o gl.ppm
    emboss-render --backend cpu --tbn $where "${options[@]}" in.off -o cpu.ppm
    grep -q '"backend":"gl","platform":"[a-z ]*","renderer":"..*","target":"RGBA..F","passes":'"${mode/shader/1}" stats.json || fail 'stats do not name OpenGL' "$(<stats.json)"
    read -r max many <<<"$(difference gl.ppm cpu.ppm)"
    ((many < 300)) || fail "$many bytes differ by more than 2, at most by $max, with --passes $mode"
  done
  # That this can fail: another light.
  emboss-render --backend cpu "${options[@]}" --light 1,2,30 in.off -o cpu.ppm
  read -r max many <<<"$(difference gl.ppm cpu.ppm)"
  ((many > 3000)) || fail 'another light is not seen'
}

test_programs_that_are_not_ours_read_the_pictures() {
  python3 -c 'import PIL' 2>/dev/null || skip 'no PIL for python3'
  cube >in.off
  emboss-render --backend cpu --size 60x40 --view iso in.off -o out.png
  emboss-render --backend cpu --size 60x40 --view iso in.off -o out.ppm
  emboss-render --backend cpu --size 60x40 --view iso in.off --to rgb >out.rgb
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
    emboss-render --backend gl $look --view iso --size 200x150 --filter linear --to ppm in.off -o gl.ppm
    # shellcheck disable=SC2086
    emboss-render --backend cpu $look --view iso --size 200x150 --filter linear --to ppm in.off -o cpu.ppm
    read -r max many <<<"$(difference gl.ppm cpu.ppm)"
    ((many < 300)) || fail "$many bytes differ by more than 2, at most by $max, with $look"
  done
  # That this can fail: another pattern.
  emboss-render --backend cpu --texture veins:scale=0.7,seed=2 --view iso --size 200x150 --filter linear --to ppm in.off -o cpu.ppm
  read -r max many <<<"$(difference gl.ppm cpu.ppm)"
  ((many > 3000)) || fail 'another pattern is not seen'
}

test_what_is_not_asked_for_is_not_read() {
  cube >in.off
  bumps >bumps.pgm
  emboss-render --backend cpu --size 32 --stats=stats.json in.off -o out.png
  ! grep -q surfaces_mapped stats.json || fail 'coordinates were made without a texture'
  emboss-render --backend cpu --size 32 --structure bumps.pgm --stats=stats.json in.off -o out.png
  grep -q '"surfaces_mapped":1' stats.json || fail 'no coordinates were made' "$(<stats.json)"
  expect_failure 1 emboss-render emboss-render --backend cpu --structure none.pgm in.off -o out.png
}

test_bumps_are_lit_from_the_side_of_the_light() {
  printf 'OFF\n4 2 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n3 0 1 2\n3 0 2 3\n' >in.off
  bumps >bumps.pgm
  # Which half of the bump in the middle of the square is the brighter one.
  brighter() {
    emboss-render --backend cpu --structure bumps.pgm --uv-scale 2 --view top --color 0.5,0.5,0.5 --background 0,0,0 --size 40 --light "$1" in.off --to ppm |
      tail -c 4800 | od -An -v -tu1 -w120 | awk '{ for (i = 1; i <= 60; ++i) { l += $i; r += $(i + 60) } } END { print (l > r) ? "left" : "right" }'
  }
  [[ $(brighter -100,1,50) == left ]] || fail 'light from the left brightens the right'
  [[ $(brighter 100,1,50) == right ]] || fail 'light from the right brightens the left'
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
  emboss-render --backend cpu --size 24x20 --frames all --to rgb --stats=stats.json run.h5 -o all.rgb
  local frames
  frames=$(grep -o '"pictures":[0-9]*' stats.json | cut -d: -f2)
  ((frames > 1)) || fail 'one frame is no film' "$(<stats.json)"
  grep -q "\"pictures_kept\":$((frames - 1))" stats.json || fail 'pictures were drawn again' "$(<stats.json)"
  [[ $(wc -c <all.rgb) == $((frames * 24 * 20 * 3)) ]] || fail 'another number of bytes than frames have'
  emboss-render --backend cpu --size 24x20 --frames 0:-1:2 run.h5 -o 'f%03d.png'
  [[ -e f000.png && ! -e f001.png ]] || fail 'the numbers of the frames are not those of the files' ./*.png
  expect_failure 1 emboss-render emboss-render --backend cpu --frames 0:99 run.h5 -o x.rgb
  expect_failure 2 emboss-render emboss-render --backend cpu --frames a:b run.h5 -o x.rgb
  expect_failure 2 emboss-render emboss-render --backend cpu --frames all run.h5 -o 'f%s.png'
}

# The tutorial, followed line by line: its commands in an empty folder, and what each block prints.
# shellcheck shell=bash

# Blocks of commands as 01.run, 02.run …, and what the commands before print as the 01.says of the same number.
blocks_of_tutorial() { # FILE
  awk '
    /^\.Bd -literal -offset indent$/ { out = sprintf("%02d.run", ++n); next }
    /^\.Bd -literal -offset indent-two$/ { out = sprintf("%02d.says", n); next }
    /^\.Ed/ { close(out); out = ""; next }
    out { print > out }' "$1"
  sed -i -e 's/\\e/\\/g' -e 's/\\&//g' [0-9]*.run
}
follow() {
  local block number
  mkdir folder
  for block in [0-9]*.run; do
    number=${block%.run}
    (cd folder && bash -euo pipefail "../$block" </dev/null) >"$number.out" 2>"$number.err" ||
      fail "block $number ends with status $?:" "$(<"$block")" "$(head -5 "$number.err")"
    [[ ! -s $number.err ]] || fail "block $number warns:" "$(<"$number.err")"
    [[ -e $number.says ]] || : >"$number.says"
    cmp "$number.out" "$number.says" || fail "block $number prints:" "$(<"$number.out")" 'expected:' "$(<"$number.says")"
  done
}

# The pictures of a folder are those of the manual: on another processor the last bits of shapes differ, and with them an edge here
# and there.
same_pictures() { # FOLDER
  python3 - "$1" "$GEWEBE_ROOT/man/pictures" <<'END'
import sys
from pathlib import Path
from PIL import Image, ImageChops
failed = False
pictures = sorted(Path(sys.argv[2]).glob("*.png"))
for expected in pictures:
    a, b = (Image.open(folder / expected.name).convert("RGB") for folder in (Path(sys.argv[1]), expected.parent))
    if a.size != b.size:
        print(f"{expected.name} has {a.size} pixels, expected {b.size}")
        failed = True
        continue
    red, green, blue = ImageChops.difference(a, b).split()
    largest = ImageChops.lighter(ImageChops.lighter(red, green), blue)
    share = sum(largest.histogram()[9:]) / (a.size[0] * a.size[1])
    if not share <= 1e-3:
        print(f"{expected.name}: {100 * share:.2f} % of its pixels are others than the manual's")
        failed = True
sys.exit(failed or len(pictures) != 3)
END
}

test_line_by_line() {
  [[ $(basename "$BUILD") == release ]] || skip 'for config=release'
  local picture runs says
  blocks_of_tutorial "$GEWEBE_ROOT/man/gewebe-tutorial.7"
  runs=(*.run) says=(*.says)
  ((${#runs[@]} > 7 && ${#says[@]} > 5)) || fail "hardly a block: ${runs[*]} ${says[*]}"
  follow
  for picture in folder/{pull,cut,press}.png; do
    [[ $(stat -c %s "$picture") -gt 10000 ]] || fail "$picture is empty"
  done
  python3 -c 'import PIL' 2>/dev/null || skip 'no PIL for python3'
  same_pictures folder || fail 'look at them, and copy them to man/pictures if they are right'
  cp folder/pull.png folder/cut.png
  ! same_pictures folder >said || fail 'another picture passes'
}

test_another_answer_is_seen() {
  printf '%s\n' '.Bd -literal -offset indent' 'echo 5 mN' '.Ed' '.Bd -literal -offset indent-two' '6 mN' '.Ed' >page.7
  blocks_of_tutorial page.7
  ! (follow) >said || fail 'another answer passes'
  rm -r folder 01.*
  printf '%s\n' '.Bd -literal -offset indent' 'echo warning >&2' '.Ed' >page.7
  blocks_of_tutorial page.7
  ! (follow) >said || fail 'a warning passes'
}

# Instruments on organs, judged from answers alone by a program that knows nothing of ours: tests/validate/instruments.py,
# which judges a thousand when it is run by hand.
# shellcheck shell=bash

test_random_instruments_push_no_further_than_they_touch() {
  command -v python3 >/dev/null || skip 'no python3'
  python3 -c 'import numpy' 2>/dev/null || skip 'no numpy for python3'
  local data=() folder=$GEWEBE_SHARED/data
  if [[ -e $folder/sofa_liver_smooth.obj ]]; then
    data=(--data "$folder")
  else
    left_out "no $folder: made models in place of organs"
  fi
  python3 "$GEWEBE_ROOT/tests/validate/instruments.py" --count 12 --keep . "${data[@]}" >table.txt ||
    fail 'an instrument pulls, is in the surface, leaves the cone, or pushes where it does not touch' "$(<table.txt)"
  [[ $(grep -cE '^(liver|spleen|colon), ' table.txt) == 9 ]] || fail 'expected nine bodies' "$(<table.txt)"
}

# The store of a cut model from that of the model before.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# ball.ela, its store with columns of some nodes, and cut.ela, which lacks some springs.
cut_ball() { # COLUMNS OPTION...
  exp2ela --primitive sphere:40x20 --fix 'z<-0.8' --bend --name ball -o ball.ela
  awk '$1 == "springs" { $2 -= 6 }
       $3 == "e" && $1 > 480 && ++edges % 97 == 0 && ++gone <= 6 { next }
       1' ball.ela >cut.ela
  ffe-precompute --columns "$1" "${@:2}" ball.ela -o ball.h5
}
same_answers() { # STORE
  printf '%s\n' "object ball cut.ela store=$1" 'force ball 520-524 0 3 1' 'displace ball 690 0 0 0.1' step 'emit forces' step |
    ffe-run | sed 's/\(\.[0-9]\{7\}\)[0-9]*/\1/g'
}

test_corrected_columns_are_those_made_afresh() {
  cut_ball 450-549,700-749
  ffe-precompute --columns 450-549,700-749 cut.ela -o afresh.h5
  ffe-precompute -j1 --update ball.h5 --before ball.ela cut.ela -o new.h5 --verify --stats=stats.json
  grep -q '"rank":6,"corrected_columns":450,' stats.json || fail "$(<stats.json)"
  ffe-precompute -j2 --update ball.h5 --before ball.ela cut.ela -o two.h5
  cmp new.h5 two.h5 || fail 'other bytes on other threads'
  GEWEBE_CPU=baseline ffe-precompute --update ball.h5 --before ball.ela cut.ela -o two.h5
  cmp new.h5 two.h5 || fail 'other bytes on another CPU'
  if has h5diff; then
    h5diff -q afresh.h5 new.h5 /ball/K /ball/K || fail 'another matrix'
    h5diff -q -p 1e-6 afresh.h5 new.h5 /ball/columns/values /ball/columns/values ||
      h5diff -q -d 1e-12 afresh.h5 new.h5 /ball/columns/values /ball/columns/values || fail 'other columns'
    ! h5diff -q -d 1e-12 ball.h5 new.h5 /ball/columns/values /ball/columns/values || fail 'the columns before'
  fi
  [[ $(same_answers new.h5) == "$(same_answers afresh.h5)" ]] || fail 'other answers'
  cp ball.h5 old.h5
  ffe-precompute --update ball.h5 --before ball.ela cut.ela
  cmp ball.h5 new.h5 || fail 'in place it is another store'
  # The same cut once more finds the store of another model.
  expect_failure 1 ffe-precompute ffe-precompute --update ball.h5 --before ball.ela cut.ela
  cmp ball.h5 new.h5 || fail 'a refusal changed the store'
}

test_columns_of_float32_and_none() {
  cut_ball all --precision float32
  ffe-precompute --update ball.h5 --before ball.ela cut.ela --verify --stats=stats.json
  grep -q '"corrected_columns":[1-9]' stats.json || fail "$(<stats.json)"
  ffe-precompute --info ball.h5 | grep -qx '  precision float32' || fail 'another precision'
  ffe-precompute ball.ela -o ball.h5
  ffe-precompute --update ball.h5 --before ball.ela cut.ela
  ffe-precompute cut.ela -o afresh.h5
  cmp ball.h5 afresh.h5 || fail 'without columns it is another store than afresh'
}

test_other_objects_are_copied() {
  cut_ball 600
  sed 's/"ball"/"other"/' ball.ela | exp2ela --fix 'z<-0.5' -o other.ela
  ffe-precompute --columns 600 ball.ela other.ela -o ball.h5
  cp ball.h5 old.h5
  ffe-precompute --update ball.h5 --before ball.ela cut.ela
  [[ $(ffe-precompute --info ball.h5 | grep -c '^object') == 2 ]] || fail "$(ffe-precompute --info ball.h5)"
  if has h5diff; then
    h5diff -q old.h5 ball.h5 /other /other || fail 'the other object has changed'
    ! h5diff -q old.h5 ball.h5 /ball/K /ball/K || fail 'the object has not changed'
  fi
}

test_what_was_not_cut_is_refused() {
  cut_ball 600
  cp ball.h5 old.h5
  exp2ela --primitive sphere:42x20 --fix 'z<-0.8' --bend --name ball -o other.ela
  expect_failure 1 ffe-precompute ffe-precompute --update ball.h5 --before ball.ela other.ela
  expect_failure 1 ffe-precompute ffe-precompute --update ball.h5 --before other.ela cut.ela
  exp2ela --fix 500 cut.ela -o fixed.ela
  expect_failure 1 ffe-precompute ffe-precompute --update ball.h5 --before ball.ela fixed.ela
  expect_failure 1 ffe-precompute ffe-precompute --update none.h5 --before ball.ela cut.ela
  # A node whose springs are all gone.
  awk '$1 == "springs" { left = $2; next } left > 0 { left--; if ($1 != 500 && $2 != 500) lines[++n] = $0; next }
       $1 == "triangles" { print "springs " n; for (k = 1; k <= n; ++k) print lines[k] } 1' ball.ela >loose.ela
  expect_failure 1 ffe-precompute ffe-precompute --update ball.h5 --before ball.ela loose.ela
  cmp ball.h5 old.h5 || fail 'a refusal changed the store'
  expect_failure 2 ffe-precompute ffe-precompute --update ball.h5 cut.ela
  expect_failure 2 ffe-precompute ffe-precompute --before ball.ela cut.ela -o new.h5
  expect_failure 2 ffe-precompute ffe-precompute --update ball.h5 --before ball.ela --columns all cut.ela
  expect_failure 2 ffe-precompute ffe-precompute --update ball.h5 --before ball.ela cut.ela ball.ela
  ffe-precompute --stage 2 ball.ela -o ball.h5
  expect_failure 1 ffe-precompute ffe-precompute --update ball.h5 --before ball.ela cut.ela
}

test_killed_at_any_moment_it_is_before_or_after() {
  cut_ball all
  cp ball.h5 old.h5
  ffe-precompute -j1 --update ball.h5 --before ball.ela cut.ela
  mv ball.h5 new.h5
  local time before=0
  for time in 0.01 0.03 0.06 0.1 0.15 0.2 0.3; do
    cp old.h5 ball.h5
    ffe-precompute -j1 --update ball.h5 --before ball.ela cut.ela &
    sleep "$time"
    kill -KILL $! 2>/dev/null || true
    wait $! 2>/dev/null || true
    if cmp -s ball.h5 old.h5; then
      before=$((before + 1))
    else
      cmp ball.h5 new.h5 || fail "killed after $time s it is neither the store before nor after"
    fi
    rm -f .ball.h5.*
  done
  ((before > 0)) || fail 'it was never killed in time'
  cp old.h5 ball.h5
  ffe-precompute -j1 --update ball.h5 --before ball.ela cut.ela
  cmp ball.h5 new.h5 || fail 'what was killed does not come out the same'
}

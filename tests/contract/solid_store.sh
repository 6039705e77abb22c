# Stores of solids: columns with rows for the surface alone, and all that is done with stores.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# s.ela: a ball of finite elements, some 1,500 nodes of which some 600 are the surface's.
solid() { # NAME [MATERIAL OPTION...]
  exp2ela --primitive sphere:16x12 --size 30 --solid --cell 12 --poisson 0.3 "${@:2}" --fix 'z<-20 and surface' --name s -o "$1" -q
}

value() { # KEY: of the store on standard input's --info
  sed -n "s/^  $1 //p"
}

test_columns_of_a_solid_have_rows_for_its_surface() {
  solid s.ela
  ffe-precompute --columns all --verify s.ela -o s.h5
  ffe-precompute --info --verify s.h5 >info
  local nodes rows
  nodes=$(value nodes <info) rows=$(value row_nodes <info)
  ((rows > 0 && rows < nodes)) || fail "$(<info)"
  [[ $(value touched_nodes <info) == "$rows" ]] || fail "$(<info)"
  (($(stat -c %s s.h5) > 72 * rows * rows)) || fail 'columns are missing'
  ffe-precompute --columns all --rows all --verify s.ela -o all.h5
  ffe-precompute --info all.h5 >info
  ! grep -q row_nodes info || fail "$(<info)"
  [[ $(value touched_nodes <info) == "$nodes" ]] || fail "$(<info)"
  # Of a net it changes nothing.
  exp2ela --primitive sphere:12x8 --name net -o net.ela
  ffe-precompute --columns all net.ela -o net.h5
  for rows in surface all; do
    ffe-precompute --columns all --rows $rows net.ela -o other.h5
    cmp net.h5 other.h5 || fail "a net's store differs with --rows $rows"
  done
  expect_failure 2 ffe-precompute ffe-precompute --rows surface s.ela -o other.h5
  expect_failure 1 ffe-precompute ffe-precompute --columns "$((nodes - 1))" s.ela -o other.h5
  expect_failure 1 ffe-precompute ffe-precompute --columns all --max-memory 1M s.ela -o other.h5
}

# The same forces and shapes as without a store, inside too.
test_a_scene_of_it_is_that_of_the_model() {
  solid s.ela
  ffe-precompute --columns all s.ela -o s.h5
  local inside last
  last=$(($(sed -n 's/^nodes //p' s.ela) - 1)) # inside
  for inside in surfaces shapes; do
    printf '%s\n' 'object s s.ela store=s.h5' "emit $inside" 'emit forces' 'gravity 0 0 -9810' 'displace s z>25 0 0.1 0' \
      'force s z>20 0 0 100' step "displace s $last 0.01 0 0.02" step >scene
    ffe-run scene >stored
    sed 's/ store=.*/ method=ffe/' scene | ffe-run >made
    paste stored made | awk 'NF % 2 { print "lines differ"; exit 1 }
      { for (i = 1; i <= NF / 2; i++) { d = $i - $(i + NF / 2); if (d < 0) d = -d; if (d > 1e-4 + 1e-6 * ($i < 0 ? -$i : $i)) { print; exit 1 } } }' ||
      fail "$inside differ"
    grep '^shapes' stored >lines.$inside
  done
  [[ $(head -1 lines.shapes) == "shapes s $((last + 1))" ]] || fail "$(<lines.shapes)"
  [[ $(head -1 lines.surfaces) == "shapes s $(ffe-precompute --info s.h5 | value row_nodes)" ]] || fail "$(<lines.surfaces)"
}

# Compressed ones have rows for the surface too, unless all are asked for; the inside comes from the factor.
test_compressed_columns_of_a_solid_have_rows_for_its_surface() {
  solid s.ela
  local kind rows last
  ffe-precompute --columns all s.ela -o plain.h5
  ffe-precompute --columns all --compress 1e-6 --verify s.ela -o s.h5
  ffe-precompute --columns all --rows surface --compress 1e-6 s.ela -o same.h5
  cmp s.h5 same.h5 || fail 'surface is not the default'
  ffe-precompute --columns surface --rows all --compress 1e-6 --verify s.ela -o all.h5
  for kind in s all; do
    ffe-precompute --info --verify $kind.h5 >$kind.info
  done
  rows=$(ffe-precompute --info plain.h5 | value row_nodes)
  [[ $(value row_nodes <s.info) == "$rows" && $(value touched_nodes <s.info) == "$rows" ]] || fail "$(<s.info)"
  [[ -z $(value row_nodes <all.info) && $(value touched_nodes <all.info) == "$rows" ]] || fail "$(<all.info)"
  awk 'NR == FNR { if ($1 == "columns_mb") some = $2; next } $1 == "columns_mb" { exit !(some > 0 && some < 0.8 * $2) }' s.info all.info ||
    fail "they take as much as all rows: $(grep columns_mb s.info all.info)"
  last=$(($(value nodes <s.info) - 1)) # inside
  for kind in surfaces shapes; do
    printf '%s\n' 'object s s.ela store=s.h5' "emit $kind" 'emit forces' 'displace s z>29 0 0.1 0' step 'force s z>20 0 0 100' step >scene
    [[ $kind == surfaces ]] || printf '%s\n' "displace s $last 0.01 0 0.02" step "displace s $last 0 0 0" "force s $last 0 0 900" step >>scene
    ffe-run --rate 1000 --stats=s.json scene >small
    sed 's/s\.h5/plain.h5/' scene | ffe-run --rate 1000 --stats=plain.json >exact
    [[ $(wc -l <small) == $(wc -l <exact) && $(wc -l <small) -gt $rows ]] || fail "$kind: other lines"
    paste small exact | awk '{ size = far = 0
      for (i = 1; i <= NF / 2; i++) { d = $i - $(i + NF / 2); far = d * d > far ? d * d : far; size = NF == 8 && i == 1 || $i * $i < size ? size : $i * $i }
      if (!(far <= (1e-4 + 1e-3 * sqrt(size)) ^ 2)) { print; exit 1 } }' ||
      fail "$kind differ"
    grep -q '"columns_read":0,' s.json || fail "plain columns are read: $(<s.json)"
    [[ $kind == shapes ]] || grep -q '"solves":0,' s.json || fail "$kind: $(<s.json)"
  done
  grep -qE '"solves":[1-9]' s.json || fail "$(<s.json)"
}

# Shapes from compressed columns may be wrong by what the store's bound allows, and no more; others by 1e-6.
test_verify_follows_the_bound_of_compressed_columns() {
  solid s.ela
  exp2ela --primitive sphere:24x16 --size 50 --bend --fix 'z<-40' --name s -o net.ela
  local model kind python
  python=$(python_with_h5py || true)
  stat() { sed -n "s/.*\"$1\":\([^,]*\).*/\1/p" stats; }
  for model in s net; do
    for kind in 0 1e-4 1e-5; do
      if [[ $kind == 0 ]]; then
        ffe-precompute --columns all $model.ela -o s.h5
      else
        ffe-precompute --columns all --compress $kind $model.ela -o s.h5
      fi
      printf '%s\n' "object s $model.ela store=s.h5" 'emit surfaces' 'force s z>20 0 0 100' step 'force s 3 0.1 0 0' 'displace s z>27 0 0.1 0' step >scene
      ffe-run --verify --stats=stats scene >/dev/null || fail "$model, $kind"
      awk -v a="$(stat compressed)" -v b=$kind 'BEGIN { exit !(a + 0 == b + 0) }' || fail "$model: $kind: $(<stats)"
      if [[ $kind == 0 ]]; then
        [[ $(stat backward_limit) == 1e-06 ]] || fail "$(<stats)"
        continue
      fi
      awk -v limit="$(stat backward_limit)" -v error="$(stat backward_error)" -v e=$kind 'BEGIN { exit !(limit > e / 10 && limit < 1 && error > 1e-6) }' ||
        fail "$model, $kind: $(<stats)"
      [[ $python ]] || continue
      "$python" -c 'import h5py; h5py.File("s.h5", "a")["s/compressed"].attrs["bound"] *= 1e-5'
      ffe-run --verify scene >/dev/null 2>message && fail "$model, $kind: a bound that does not hold is taken"
      grep -qE "^ffe-run: the backward error of a shape is [^ ]*, expected at most [^ ]* with columns compressed within [^ ]*$" message ||
        fail "$(<message)"
    done
  done
  [[ $python ]] || left_out 'bounds that do not hold: no h5py for python3'
}

# examples/store/displace.py knows the page alone: plain columns, and compressed ones within their bound.
test_the_python_example_reads_stores_of_solids() {
  local python kind nodes n within
  python=$(python_with_h5py) || skip 'no h5py for python3'
  solid s.ela
  ffe-precompute s.ela -o factor.h5
  ffe-precompute --columns all s.ela -o surface.h5
  ffe-precompute --columns surface --rows all --precision float32 s.ela -o all.h5
  ffe-precompute --columns all --compress 1e-4 s.ela -o surface-compressed.h5
  ffe-precompute --columns '300,301,400,430' --rows all --compress 1e-3 s.ela -o some-compressed.h5
  nodes=$(ffe-precompute --info surface.h5 | value row_nodes)
  printf '%s\n' 'object s s.ela store=factor.h5' 'force s 300 10 0 40' 'force s 430 0 -20 5' 'emit shapes' step | ffe-run |
    awk '/^shapes /{ n = $3; next } n-- > 0' >shape
  awk '/^nodes /{ n = $2; next } n-- > 0 { print $1, $2, $3 }' s.ela >rest
  for kind in surface all surface-compressed some-compressed; do
    "$python" "$GEWEBE_ROOT/examples/store/displace.py" $kind.h5 s 300 10 0 40 430 0 -20 5 >u
    n=$(wc -l <rest)
    [[ $kind != surface* ]] || n=$nodes
    [[ $(wc -l <u) == "$n" ]] || fail "$kind: $(wc -l <u) nodes, expected $n"
    within='1e-6 * most'
    if [[ $kind == *compressed ]]; then
      # The bound of an entry, times the sum of forces.
      within="75 * $("$python" -c 'import h5py, sys; print(h5py.File(sys.argv[1])["s/compressed"].attrs["bound"])' $kind.h5) + 1e-9 * most"
    fi
    agree() { # FACTOR on u
      paste -d' ' rest u shape | awk -v factor="$1" -v n="$n" 'NR <= n { for (a = 1; a <= 3; ++a) {
          d = $a + factor * $(a + 3) - $(a + 6); d = d < 0 ? -d : d; if (!(d <= worst)) worst = d
          if ($(a + 3) * $(a + 3) > most * most) most = $(a + 3) < 0 ? -$(a + 3) : $(a + 3) } }
        END { exit !(most > 0 && worst <= '"$within"') }'
    }
    agree 1 || fail "$kind: Python says something else"
    ! agree 1.01 || fail "$kind: the check sees nothing"
    [[ $("$python" "$GEWEBE_ROOT/examples/store/displace.py" --at 7 $kind.h5 s 300 10 0 40 430 0 -20 5) == "$(sed -n 8p u)" ]] ||
      fail "$kind: another displacement of one node"
  done
  ! "$python" "$GEWEBE_ROOT/examples/store/displace.py" some-compressed.h5 s 302 1 0 0 >u 2>&1 || fail 'a node without columns is taken'
}

# Nothing is solved for until somebody asks for what is inside.
test_the_inside_is_solved_for_when_it_is_asked_for() {
  solid s.ela
  ffe-precompute --columns all s.ela -o s.h5
  printf '%s\n' 'object s s.ela store=s.h5' 'emit surfaces' 'emit forces' 'displace s z>25 0 0.1 0' step \
    'displace s z>25 0 0.2 0' step >scene
  ffe-run --rate 1000 --stats=s.json scene >/dev/null
  grep -q '"solves":0,' s.json || fail "$(<s.json)"
  echo 'emit shapes' | cat scene - <(echo step) | ffe-run --rate 1000 --stats=s.json >/dev/null
  grep -qE '"solves":[1-9]' s.json || fail "$(<s.json)"
  ffe-run --verify --stats=s.json scene >/dev/null
  grep -qE '"backward_error":[0-9.]+e-1[3-9]' s.json || fail "$(<s.json)"
}

test_parts_interrupts_and_stages_of_a_solid() {
  solid s.ela
  ffe-precompute --columns all s.ela -o whole.h5
  local part
  for part in 1 2 3; do
    ffe-precompute --columns all --shard $part/3 s.ela -o $part.h5
  done
  ffe-precompute --merge --verify 3.h5 1.h5 2.h5 -o merged.h5
  cmp whole.h5 merged.h5 || fail 'parts make other bytes'
  ffe-precompute --columns all --rows all --shard 2/3 s.ela -o 2.h5
  expect_failure 1 ffe-precompute ffe-precompute --merge 1.h5 2.h5 3.h5 -o out.h5
  # Interrupted, it goes on, and not as another kind of work.
  ffe-precompute -j1 --columns all s.ela -o part.h5 &
  local pid=$!
  while [[ ! -e part.h5.part.log || $(wc -l <part.h5.part.log) -lt 30 ]]; do
    kill -0 "$pid" 2>/dev/null || fail 'it ended too early'
  done
  kill -KILL "$pid"
  wait "$pid" 2>/dev/null || true
  ffe-precompute --columns all --rows all s.ela -o part.h5 2>message && fail 'other rows are taken up'
  grep -q "part.h5.part: was begun with other options for 's'" message || fail "$(<message)"
  ffe-precompute -v --columns all s.ela -o part.h5 2>message
  grep -q 'nodes are taken up' message || fail "$(<message)"
  cmp whole.h5 part.h5 || fail 'another store than that of an undisturbed run'
  # A second stage.
  solid stiff.ela --young 20000
  ffe-precompute --stage 2 --columns all --verify stiff.ela -o whole.h5
  [[ $(ffe-precompute --info whole.h5 | value row_nodes | sort -u | wc -l) == 1 ]] || fail 'stages have other rows'
  printf '%s\n' 'object s s.ela store=whole.h5' 'emit surfaces' 'two-step s 10 series' 'displace s z>25 0 1 0' step >scene
  ffe-run scene >stored
  sed 's/ store=.*/ method=ffe/; s/series/series stage=stiff.ela/' scene | ffe-run >made
  paste stored made | awk '$1 != "shapes" && NF == 6 { for (i = 1; i <= 3; i++) { d = $i - $(i + 3); if (d * d > 1e-8) { print; exit 1 } } }' ||
    fail 'the second stage is another'
}

test_a_cut_of_a_solid_is_refused_by_name() {
  solid s.ela
  ffe-precompute --columns all s.ela -o s.h5
  cp s.h5 before.h5
  ffe-precompute --update s.h5 --before s.ela s.ela 2>message && fail 'it is taken'
  grep -q '^ffe-precompute: s.ela: .*tetrahedra' message || fail "$(<message)"
  cmp s.h5 before.h5 || fail 'the store has changed'
}

# What asks for more memory than there is gets one clear error at once, by default within `ulimit -v`.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# Runs a command that needs or announces far too much under 3 GB of address space: limited TOOL COMMAND...
limited() {
  local tool=$1 begin=$SECONDS
  shift
  [[ $BUILD != */sanitize && $BUILD != */thread ]] || skip 'a sanitizer takes terabytes of address space'
  # shellcheck disable=SC2016 # the inner shell expands these
  expect_failure 1 "$tool" bash -c 'ulimit -c 0 -v 3000000 -t 8; "$1" -q "${@:2}" 2>&1 >out.txt | tee stderr.copy >&2; exit "${PIPESTATUS[0]}"' - "$@"
  ! grep -E 'out of memory|less memory|fault of this program' stderr.copy || fail "no reason from: $*"
  ((SECONDS - begin < 10)) || fail "$((SECONDS - begin)) s for: $*"
  rm -f stderr.copy out.txt
}

# Overwrites bytes of a file: patch FILE OFFSET HEX...
patch() {
  local file=$1 at=$2
  shift 2
  # shellcheck disable=SC2059 # the bytes are the format
  printf "$(printf '\\x%s' "$@")" | dd of="$file" bs=1 seek="$at" conv=notrunc status=none
}

# A cube with one corner moved far away: a needle that few voxels hold and many blocks meet.
spike() {
  cube | sed "s/^-1 1 1\$/-1 1 $1/"
}

test_meshes() {
  local kind number=4000000000
  printf '%s\n' ply 'format ascii 1.0' "element vertex $number" 'property float x' 'property float y' 'property float z' \
    'element face 1' 'property list uchar int vertex_indices' end_header '0 0 0' '3 0 0 0' >in.ply
  printf 'OFF\n%s 1 0\n0 0 0\n3 0 0 0\n' $number >in.off
  { head -c 80 /dev/zero && printf '\xff\xff\xff\x7f' && head -c 100 /dev/zero; } >in.stl
  printf '%s\n' '<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>' \
    "<Piece NumberOfPoints=\"$number\" NumberOfPolys=\"1\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0" \
    '</DataArray></Points><Polys><DataArray type="Int64" Name="connectivity" format="ascii">0 0 0</DataArray>' \
    '<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray></Polys></Piece></PolyData></VTKFile>' >in.vtp
  cube >cube.off
  for kind in dae glb 3ds obj; do exp2ela -q --to $kind cube.off -o in.$kind; done
  sed -i 's|<p>0 |<p>/dev/stdin |' in.dae
  sed -i 's/"count":[0-9]*/"count":9999/' in.glb
  patch in.3ds 2 ff ff ff 7f
  echo "f 1 2 $number" >>in.obj
  for kind in ply off stl vtp dae glb 3ds obj; do
    limited exp2ela exp2ela in.$kind -o out.ela
    limited voxelize voxelize --dim 20 in.$kind -o out.vdb
    limited emboss-render emboss-render in.$kind -o out.png
  done
}

test_needles_and_fine_voxels() {
  local options
  spike 1e9 >in.off
  for options in '' '--antialias exact' '--antialias lines:4' '--antialias box:6' '--antialias sramek' '--rule winding' '--rule zbuffer'; do
    # shellcheck disable=SC2086 # words
    limited voxelize voxelize $options --voxel 100 in.off -o out.vdb
  done
  limited exp2ela exp2ela --solid in.off -o out.ela
  # Several needles: no single triangle tells how much they need.
  for options in 1e8 3e8 5e8 7e8; do spike $options; done | awk '
    /OFF/ { ++n; next } / 12 0$/ { next }
    /^3 / { f[++m] = "3 " $2 + 8 * (n - 1) " " $3 + 8 * (n - 1) " " $4 + 8 * (n - 1); next }
    { p[++k] = $1 + 3e4 * n " " $2 " " $3 }
    END { print "OFF\n" k, m, 0; for (i = 1; i <= k; ++i) print p[i]; for (i = 1; i <= m; ++i) print f[i] }' >needles.off
  limited voxelize voxelize --voxel 150 needles.off -o out.vdb
  cube >cube.off
  limited voxelize voxelize --voxel 1e-5 cube.off -o out.vdb
  limited voxelize voxelize --antialias exact --dim 30000 cube.off -o out.vdb
  limited exp2ela exp2ela --solid --cell 1e-4 cube.off -o out.ela
  printf '0 0 0 1e6\n' >in.particles
  limited metaball2vol metaball2vol --voxel 0.5 in.particles -o out.vdb
}

test_volumes() {
  local at
  sample metaball2vol
  metaball2vol --voxel 0.5 in.particles -o in.vdb
  limited mc-opt mc-opt --resample 0.0005 in.vdb -o out.ply
  limited mc-opt mc-opt --tets --cell 0.0005 in.vdb -o out.msh
  at=$(grep -abo UniformScaleMap in.vdb | head -1 | cut -d: -f1)
  patch in.vdb $((at - 4)) 00 00 00 f0 # the length of that name
  limited mc-opt mc-opt in.vdb -o out.ply
  limited csg csg add in.vdb in.vdb -o out.vdb
  limited metaball2vol metaball2vol --like in.vdb in.particles -o out.vdb
  cube >in.off
  limited voxelize voxelize --like in.vdb in.off -o out.vdb
  limited emboss-render emboss-render in.vdb -o out.png
}

test_label_volumes_and_scans() {
  local name in=$GEWEBE_ROOT/tests/golden/in
  cp "$in"/label_huge.nii in.nii
  gzip -nc in.nii >in.nii.gz
  printf '%s\n' NRRD0004 'type: uint8' 'dimension: 3' 'sizes: 30000 30000 30000' 'encoding: raw' '' x >in.nrrd
  printf '%s\n' 'ObjectType = Image' 'NDims = 3' 'DimSize = 30000 30000 30000' 'ElementType = MET_UCHAR' 'ElementDataFile = LOCAL' x >in.mha
  sed 's/^XDIM=.*/XDIM=30000/; s/^YDIM=.*/YDIM=30000/; s/^ZDIM=.*/ZDIM=30000/' "$in"/label.inr >in.inr
  sample mc-opt
  for name in in.nii in.nii.gz in.nrrd in.mha in.inr; do
    limited voxelize voxelize --label 1 $name -o out.vdb
    limited voxelize voxelize --threshold 1 $name -o out.vdb
    limited mc-opt mc-opt --tets --materials $name in.vdb -o out.msh
  done
}

test_tetrahedra_models_and_stores() {
  local kind number=4000000000
  sample mc-opt
  for kind in msh vtu mesh ply; do mc-opt --tets --cell 3 in.vdb -o in.$kind; done
  mc-opt --tets --cell 3 in.vdb -o in.node
  sed -i "/Nodes/{n;s/^[0-9]*/$number/}" in.msh
  sed -i "s/NumberOfPoints=\"[0-9]*\"/NumberOfPoints=\"$number\"/" in.vtu
  sed -i "/^Vertices/{n;s/.*/$number/}" in.mesh
  sed -i "s/^element vertex .*/element vertex $number/" in.ply
  sed -i "1s/^[0-9]*/$number/" in.node
  for kind in msh vtu mesh ply node; do
    limited exp2ela exp2ela in.$kind -o out.ela
    limited emboss-render emboss-render in.$kind -o out.png
  done
  sample ffe-run
  cp in.ela good.ela
  sed -i "s/^nodes .*/nodes $number/" in.ela
  limited ffe-run ffe-run in.scene -o out.h5
  limited ffe-precompute ffe-precompute in.ela -o out.h5
  limited exp2ela exp2ela in.ela -o out.ela
  limited exp2ela exp2ela --primitive sphere:9999x9999 -o out.ela
  printf '%s\n' 'object cube good.ela' 'emit forces' "step $number 1e-9" >in.scene
}

test_pictures() {
  cube >in.off
  emboss-render --backend cpu --size 64 in.off -o in.png
  patch in.png 16 7f ff ff ff 7f ff ff ff # width and height
  limited emboss-render emboss-render --backend cpu --texture in.png in.off -o out.png
  printf 'P6 2000000000 2000000000 255\n' >in.ppm
  limited emboss-render emboss-render --backend cpu --texture in.ppm in.off -o out.png
  limited emboss-render emboss-render --backend cpu --size 32768x32768 in.off -o out.png
}

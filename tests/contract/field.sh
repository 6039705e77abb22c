# ffe-run --field: displacement fields in the voxels of an image, as nibabel reads them.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# Reads fields, and interpolates what the HDF5 file says of the same run by itself.
field_script() {
  cat <<'P'
import sys
import h5py, nibabel, numpy

def reference(name):
    """Oblique, unlike spacings, around the ball and beyond it."""
    a, b = 0.4, 0.3
    turn = numpy.array([[numpy.cos(a), -numpy.sin(a), 0], [numpy.sin(a), numpy.cos(a), 0], [0, 0, 1]]) @ \
        numpy.array([[1, 0, 0], [0, numpy.cos(b), -numpy.sin(b)], [0, numpy.sin(b), numpy.cos(b)]])
    affine = numpy.eye(4)
    affine[:3, :3] = turn @ numpy.diag([-1.1, 1.3, 1.7])
    size = numpy.array([24, 21, 17])
    affine[:3, 3] = -affine[:3, :3] @ ((size - 1) / 2) + (0.3, -0.2, 0.1)
    nibabel.save(nibabel.Nifti1Image(numpy.zeros(size, 'i2'), affine), name)

def places(image):
    i, j, k = numpy.meshgrid(*(range(n) for n in image.shape[:3]), indexing='ij')
    return numpy.stack([i, j, k], axis=-1).reshape(-1, 3) @ image.affine[:3, :3].T + image.affine[:3, 3]

def read(name, like):
    """Vectors of all voxels, in RAS."""
    image, expected = nibabel.load(name), nibabel.load(like)
    assert image.shape == (*expected.shape[:3], 1, 3), image.shape
    assert image.header['intent_code'] == 1007 and image.get_data_dtype() == numpy.float32
    assert image.header.get_xyzt_units()[0] == 'mm' and image.header['sform_code'] == 1 and image.header['qform_code'] == 1
    for affine in image.affine, image.get_qform():
        assert abs(affine - expected.affine).max() < 1e-5, affine - expected.affine
    return numpy.asarray(image.dataobj).reshape(-1, 3) * (-1, -1, 1)  # LPS to RAS

EDGES = (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)

def interpolate(points, cells, values, at):
    """By the elements whose corners hold them, straight ones; NaN outside."""
    out = numpy.full(at.shape, numpy.nan)
    for cell in cells:
        p = points[cell[:4]]
        inside = numpy.flatnonzero(((at >= p.min(axis=0) - 1e-9) & (at <= p.max(axis=0) + 1e-9)).all(axis=1))
        l = numpy.linalg.solve((p[1:] - p[0]).T, (at[inside] - p[0]).T).T
        l = numpy.concatenate((1 - l.sum(axis=1, keepdims=True), l), axis=1)
        held = l.min(axis=1) >= -1e-9
        l, inside = l[held], inside[held]
        if len(cell) == 10:
            w = numpy.concatenate((l * (2 * l - 1), numpy.stack([4 * l[:, a] * l[:, b] for a, b in EDGES], axis=1)), axis=1)
        else:
            w = l
        out[inside] = w @ values[cell]
    return out

def solid(name, file='run.h5'):
    with h5py.File(file) as f:
        o = f['objects'][name]
        return o['points'][:], o['tetrahedra'][:].astype(int), o['displacement'][-1].astype(float)
P
}
need_readers() { python3 -c 'import nibabel, h5py, numpy' 2>/dev/null || skip 'no nibabel, h5py and numpy for python3'; }

test_fields_there_and_back_are_those_of_the_elements() {
  need_readers
  local order
  { field_script; echo "reference('ref.nii.gz')"; } | python3 -
  printf '%s\n' 'object ball ball.ela' 'displace ball near:0,0,12,5 2 1 3' step >pull.scene
  for order in 1 2; do
    echo '0 0 0 16' | metaball2vol --voxel 1 | mc-opt --tets --cell 5 | exp2ela --order $order --fix 'z<-4' --name ball -o ball.ela
    ffe-run -q pull.scene -o run.h5
    ffe-run -q pull.scene --field ref.nii.gz -o back.nii.gz
    ffe-run -q pull.scene --field ref.nii.gz --field-at rest --field-outside nan -o forth.nii
    { field_script; cat <<'P'; } | python3 - $order
points, cells, u = solid('ball')
assert cells.shape[1] == (4 if sys.argv[1] == '1' else 10)
x = places(nibabel.load('ref.nii.gz'))
expected, forth = interpolate(points, cells, u, x), read('forth.nii', 'ref.nii.gz')
held = ~numpy.isnan(expected[:, 0])
assert 300 < held.sum() < len(x) // 2 and (numpy.isnan(forth).all(axis=1) == ~held).all()
assert abs(expected[held]).max() > 1
# The file of results has single precision.
assert abs(forth - expected)[held].max() < 1e-6, abs(forth - expected)[held].max()
back = read('back.nii.gz', 'ref.nii.gz')
held = (back != 0).any(axis=1)
assert held.sum() > 300
rest = x[held] + back[held]
there = rest + interpolate(points, cells, u, rest)
# (Those on the surface may be rounded to beyond it.)
assert numpy.isnan(there[:, 0]).sum() < 5
assert numpy.nanmax(abs(there - x[held])) < 3e-6, numpy.nanmax(abs(there - x[held]))
# The other sign is seen.
assert numpy.nanmax(abs(x[held] - 2 * back[held] - there)) > 0.1
P
  done
}

# Every node is taken to its place: the field is that map, in voxels inside, to 1e-6 mm.
test_an_affine_displacement_is_reproduced() {
  need_readers
  { field_script; echo "reference('ref.nii.gz')"; } | python3 -
  echo '0 0 0 16' | metaball2vol --voxel 1 | mc-opt --tets --cell 6 | exp2ela --order 1 --name ball -o ball.ela
  awk 'BEGIN { print "object ball ball.ela" } $1 == "nodes" { n = $2; k = 0; next }
    k < n { printf "displace ball %d %.17g %.17g %.17g\n", k++, 0.5 + 0.1 * $1 - 0.05 * $2, -0.3 + 0.08 * $3, 0.2 - 0.06 * $1 + 0.04 * $2 + 0.1 * $3 }
    END { print "step" }' ball.ela >affine.scene
  ffe-run -q affine.scene --field ref.nii.gz --field-at rest --field-outside nan --to nii >forth.nii
  ffe-run -q affine.scene --field ref.nii.gz --field-outside nan -o back.nii.gz
  { field_script; cat <<'P'; } | python3 -
x = places(nibabel.load('ref.nii.gz'))
A = numpy.array([[0.1, -0.05, 0], [0, 0, 0.08], [-0.06, 0.04, 0.1]])
b = numpy.array([0.5, -0.3, 0.2])
forth, back = read('forth.nii', 'ref.nii.gz'), read('back.nii.gz', 'ref.nii.gz')
rest = (x - b) @ numpy.linalg.inv(numpy.eye(3) + A).T
for found, expected in (forth, x @ A.T + b), (back, rest - x):
    held = ~numpy.isnan(found[:, 0])
    assert held.sum() > 300, held.sum()
    assert abs(found - expected)[held].max() < 1e-6, abs(found - expected)[held].max()
P
}

test_what_has_no_field_is_refused() {
  echo '0 0 0 8' | metaball2vol --voxel 1 -o in.vdb
  mc-opt in.vdb | exp2ela --name net -o net.ela
  printf '%s\n' 'object net net.ela' step >net.scene
  expect_failure 1 ffe-run ffe-run -q net.scene --field "$GEWEBE_ROOT/tests/golden/in/label.nii" -o out.nii.gz
  ffe-run -q net.scene --field "$GEWEBE_ROOT/tests/golden/in/label.nii" -o out.nii.gz 2>said || true
  grep -q 'net: has no tetrahedra' said || fail "$(<said)"
  expect_failure 1 ffe-run ffe-run -q net.scene --field net.ela -o out.nii.gz
  [[ ! -e out.nii.gz ]] || fail 'a file is left'
}

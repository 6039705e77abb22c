# Volumes as dense images, as other programs read them.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# Images of a volume: of voxels that a scan's affine rotates and mirrors where nibabel can make one, else of another scan.
images() {
  cp "$GEWEBE_ROOT/tests/golden/in/label.nii" scan.nii
  if python3 -c 'import nibabel, numpy' 2>/dev/null; then
    python3 - <<'END'
import nibabel, numpy
from nibabel.quaternions import quat2mat
labels = numpy.zeros((20, 24, 14), numpy.int16)
labels[3:16, 3:9, 3:11] = 3
labels[3:8, 3:20, 3:7] = 3
affine = numpy.eye(4)
affine[:3, :3] = quat2mat([0.9, 0.2, -0.3, 0.25]) @ numpy.diag([-1.5, 1.5, 1.5])
affine[:3, 3] = [10, -20, 30]
image = nibabel.Nifti1Image(labels, affine)
image.set_sform(affine, 1); image.set_qform(affine, 1)
nibabel.save(image, 'scan.nii')
END
  fi
  voxelize -q --label 3 scan.nii -o in.vdb
  local suffix
  for suffix in nii nii.gz nrrd mha; do
    csg -q add in.vdb in.vdb -o "in.$suffix"
  done
}

# Read as scans again, all give the surface of the volume itself, at its place.
test_images_hold_the_values_of_the_volume() {
  local suffix
  images
  box() { awk '$1 == "v" { for (k = 2; k < 5; ++k) { if (!n || $k < a[k]) a[k] = $k; if (!n || $k > b[k]) b[k] = $k } n = 1 } END { for (k = 2; k < 5; ++k) print a[k], b[k] }' "$1"; }
  near() { # ONE OTHER MM
    paste -d ' ' <(box "$1") <(box "$2") | awk -v e="$3" '{ if ($1 - $3 > e || $3 - $1 > e || $2 - $4 > e || $4 - $2 > e) exit 1 }'
  }
  mc-opt -q in.vdb -o in.obj
  for suffix in nii nii.gz nrrd mha; do
    voxelize -q --threshold 0.5 "in.$suffix" -o again.vdb
    mc-opt -q again.vdb -o "$suffix.obj"
    near "$suffix.obj" in.obj 1.2 || fail "the surface of $suffix moved" "$(box "$suffix.obj")" "$(box in.obj)"
    near "$suffix.obj" nii.obj 1e-4 || fail "$suffix lies elsewhere than nii" "$(box "$suffix.obj")" "$(box nii.obj)"
  done
  ! near <(sed 's/^v \([^ ]*\)/v 1\1/' in.obj) in.obj 1.2 || fail 'the check sees nothing'
}

test_nibabel_reads_our_images() {
  python3 -c 'import nibabel, numpy' 2>/dev/null || skip 'no nibabel and numpy for python3'
  images
  python3 - <<'END'
import gewebe, nibabel, numpy
a, b = nibabel.load('in.nii'), nibabel.load('in.nii.gz')
v, w = a.get_fdata(), b.get_fdata()
assert v.dtype == numpy.float64 and a.get_data_dtype() == numpy.float32 and (v == w).all()
assert (a.affine == b.affine).all() and a.header['sform_code'] == 1
assert v.max() > 0.5 and (v > 0).sum() > 8, (v.max(), (v > 0).sum())
# The box has a margin of one voxel without values.
assert all((face == 0).all() for face in (v[0], v[-1], v[:, 0], v[:, -1], v[:, :, 0], v[:, :, -1]))
# The middle of the values is that of the surface, in the world.
places = numpy.argwhere(v > 0) @ a.affine[:3, :3].T + a.affine[:3, 3]
weights = v[v > 0]
middle = (places * weights[:, None]).sum(0) / weights.sum()
import subprocess
mesh = gewebe.run(['mc-opt', '-q', 'in.vdb', '--to', 'ply']).mesh()
p, t = mesh.points, mesh.triangles
volumes = numpy.einsum('ij,ij->i', p[t[:, 0]], numpy.cross(p[t[:, 1]], p[t[:, 2]])) / 6
centre = ((p[t[:, 0]] + p[t[:, 1]] + p[t[:, 2]]) / 4 * volumes[:, None]).sum(0) / volumes.sum()
size = numpy.linalg.norm(a.affine[:3, 0])
assert numpy.abs(middle - centre).max() < 0.5 * size, (middle, centre, size)
END
}

test_vtk_reads_our_images() {
  python3 -c 'import nibabel, vtk' 2>/dev/null || skip 'no nibabel and VTK for python3'
  images
  python3 - <<'END'
import nibabel, numpy, vtk
from vtk.util.numpy_support import vtk_to_numpy
image = nibabel.load('in.nii')
v = image.get_fdata()
reader = vtk.vtkMetaImageReader(); reader.SetFileName('in.mha'); reader.Update()
data = reader.GetOutput()
assert data.GetDimensions() == v.shape, data.GetDimensions()
values = vtk_to_numpy(data.GetPointData().GetScalars()).reshape(v.shape[::-1]).transpose(2, 1, 0)
assert (values == v).all()
assert numpy.allclose(data.GetSpacing(), numpy.linalg.norm(image.affine[:3, :3], axis=0)), data.GetSpacing()
END
}

# By the format's own description: teem.sourceforge.net/nrrd/format.html.
test_nrrd_is_what_its_description_says() {
  python3 -c 'import nibabel, numpy' 2>/dev/null || skip 'no nibabel and numpy for python3'
  images
  csg -q -u add in.vdb in.vdb -o raw.nrrd
  python3 - <<'END'
import gzip, nibabel, numpy
image = nibabel.load('in.nii')
for name, unpack in ('in.nrrd', gzip.decompress), ('raw.nrrd', bytes):
    head, data = open(name, 'rb').read().split(b'\n\n', 1)
    lines = head.decode().split('\n')
    assert lines[0] == 'NRRD0004'
    field = dict(line.split(': ', 1) for line in lines[1:])
    vector = lambda text: [float(x) for x in text.strip('()').split(',')]
    assert field['space'] == 'right-anterior-superior' and field['type'] == 'float' and field['endian'] == 'little'
    assert [int(n) for n in field['sizes'].split()] == list(image.shape)
    columns = [vector(t) for t in field['space directions'].split()] + [vector(field['space origin'])]
    assert numpy.abs(numpy.array(columns).T - image.affine[:3]).max() < 1e-4
    values = numpy.frombuffer(unpack(data), '<f4').reshape(image.shape, order='F')
    assert (values == image.get_fdata()).all()
END
}

# Labels of a real CT, and of files that another program wrote, to surfaces in the right place.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# Numbers of --stats: number KEY FILE
number() { sed -n "s/.*\"$1\":\([-0-9.e+]*\).*/\1/p" "$2"; }
# Is |A / B - 1| <= C?
near() { awk -v a="$1" -v b="$2" -v c="$3" 'BEGIN { d = a / b - 1; exit !(d <= c && -d <= c) }'; }

test_organs_of_a_ct_keep_volume_and_are_closed() {
  local data=$GEWEBE_SHARED/data/ts_abdomen_seg_3mm.nii.gz organ label tolerance
  [[ -f $data ]] || skip 'no data'
  for organ in liver:5:0.005 gallbladder:4:0.03 aorta:52:0.04; do
    IFS=: read -r organ label tolerance <<<"$organ"
    voxelize --label "$label" --stats=labels "$data" | mc-opt --stats=mesh -o "$organ.ply"
    near "$(number volume mesh)" "$(number label_volume labels)" "$tolerance" ||
      fail "$organ: volume $(number volume mesh), labels $(number label_volume labels)"
    [[ $(number inside_voxels labels) == "$(number label_voxels labels)" ]] || fail "$organ: centres changed sides"
    grep -q '"closed":true' mesh || fail "$organ is open" "$(<mesh)"
    rm labels mesh "$organ.ply"
  done
}

test_pynrrd_writes_segments_with_names() {
  python3 -c 'import nrrd' 2>/dev/null || skip 'no pynrrd for python3'
  python3 - <<'END'
import nrrd, numpy
labels = numpy.zeros((12, 10, 8), 'uint8')
labels[2:6, 2:7, 2:6] = 1
labels[7:10, 3:6, 2:5] = 2
nrrd.write('in.seg.nrrd', labels, {
    'space': 'left-posterior-superior', 'space directions': numpy.diag([1.5, 1.5, 2]), 'space origin': [10, 20, 30.0],
    'kinds': ['domain'] * 3, 'encoding': 'gzip', 'Segment0_Name': 'left kidney', 'Segment0_LabelValue': '2',
    'Segment1_Name': 'Tumour 1', 'Segment1_LabelValue': '1'})
END
  voxelize --label list in.seg.nrrd >listed
  [[ $(<listed) == $'0 853 3838.5\n1 80 360 Tumour 1\n2 27 121.5 left kidney' ]] || fail "$(<listed)"
  voxelize --label 'left kidney' --stats=stats in.seg.nrrd -o named.vdb
  voxelize --label 2 in.seg.nrrd | cmp - named.vdb
  [[ $(number label_voxels stats) == 27 ]] || fail "$(<stats)"
  rm in.seg.nrrd listed stats named.vdb
}

# Points of the mesh against the labels about them: in the world of nibabel's affine, every point must lie between a
# labelled centre and another one, nearer than a voxel's diagonal to both.
test_the_liver_lies_where_nibabel_says() {
  local data=$GEWEBE_SHARED/data/ts_abdomen_seg_3mm.nii.gz
  [[ -f $data ]] || skip 'no data'
  python3 -c 'import nibabel' 2>/dev/null || skip 'no nibabel for python3'
  local label
  for label in 5 4; do
    voxelize --label $label "$data" | mc-opt --to obj -o in.obj
    python3 - "$data" $label in.obj <<'END'
import sys
import nibabel
import numpy as np
image = nibabel.load(sys.argv[1])
inside = np.pad(np.asarray(image.dataobj) == int(sys.argv[2]), 2)
points = np.array([[float(w) for w in l.split()[1:4]] for l in open(sys.argv[3]) if l.startswith('v ')])
assert len(points) > 500

def misses(affine):
    index = (np.linalg.inv(affine) @ np.c_[points, np.ones(len(points))].T)[:3].T
    corner = np.floor(index).astype(int) + 2
    if corner.min() < 0 or (corner + 1 >= np.array(inside.shape)).any():
        return len(points)
    cells = sum(inside[corner[:, 0] + a, corner[:, 1] + b, corner[:, 2] + c].astype(int)
                for a in (0, 1) for b in (0, 1) for c in (0, 1))
    return ((cells == 0) | (cells == 8)).sum()

shifted = image.affine.copy()
shifted[0, 3] += 4.5
mirrored = image.affine @ np.diag([-1, 1, 1, 1])
bad = misses(image.affine)
assert bad <= 0.02 * len(points), (bad, len(points))
assert misses(shifted) > 0.1 * len(points) and misses(mirrored) > 0.5 * len(points), 'the check sees nothing'
END
    rm in.obj
  done
}

# A rotated, mirrored, anisotropic volume as nibabel writes it, by qform and by sform.
test_rotated_volumes_of_nibabel() {
  python3 -c 'import nibabel' 2>/dev/null || skip 'no nibabel for python3'
  python3 - <<'END'
import nibabel
import numpy as np
from nibabel.quaternions import quat2mat
labels = np.zeros((20, 24, 14), np.int16)
labels[3:16, 3:9, 3:11] = 4
labels[3:8, 3:20, 3:7] = 4
q = np.array([0.8, 0.1, -0.5, 0.3])
affine = np.eye(4)
affine[:3, :3] = quat2mat(q / np.linalg.norm(q)) @ np.diag([0.9, 1.1, -2])
affine[:3, 3] = [-120, 35, 250]
for name, sform, qform in (('in_s.nii.gz', 1, 0), ('in_q.nii.gz', 0, 1)):
    image = nibabel.Nifti1Image(labels, affine)
    image.set_sform(affine if sform else None, sform)
    image.set_qform(affine if qform else None, qform)
    image.to_filename(name)
index = np.argwhere(labels == 4).mean(0)
np.savetxt('in.centroid', affine[:3, :3] @ index + affine[:3, 3])
END
  local name
  for name in in_s in_q; do
    voxelize --label 4 $name.nii.gz | mc-opt --epsilon 0 --to obj -o in.obj
    python3 - <<'END'
import numpy as np
lines = [l.split() for l in open('in.obj')]
p = np.array([[float(w) for w in l[1:4]] for l in lines if l and l[0] == 'v'])
t = np.array([[int(w.split('/')[0]) - 1 for w in l[1:4]] for l in lines if l and l[0] == 'f'])
a, b, c = p[t[:, 0]], p[t[:, 1]], p[t[:, 2]]
d = np.einsum('ij,ij->i', a, np.cross(b, c)) / 6
assert d.sum() > 0, 'inside out'
centroid = (d[:, None] * (a + b + c) / 4).sum(0) / d.sum()
error = np.linalg.norm(centroid - np.loadtxt('in.centroid'))
assert error < 0.3, error
END
    rm in.obj $name.nii.gz
  done
  rm in.centroid
}

# The header of a pair is read with its image, whatever the folder.
test_two_files_are_found_from_anywhere() {
  mkdir folder
  cp "$GEWEBE_ROOT"/tests/golden/in/label.{hdr,img,mhd,nhdr} folder
  local name
  for name in hdr mhd nhdr; do
    voxelize --label 3 folder/label.$name -o "$name.vdb"
    cmp "$name.vdb" hdr.vdb
  done
  rm folder/label.img
  for name in hdr mhd nhdr; do
    expect_failure 1 voxelize voxelize --label 3 folder/label.$name
  done
  rm -r folder ./*.vdb
}

# Every truncated prefix of a NIfTI file, compressed or not, is refused in one line.
test_truncated_label_volumes() {
  local file size n
  for file in label.nii label.nii.gz label.nrrd label.mha; do
    file=$GEWEBE_ROOT/tests/golden/in/$file
    size=$(stat -c %s "$file")
    for ((n = 0; n < size; n += 1 + size / 12)); do
      head -c $n "$file" >in.cut
      expect_failure 1 voxelize voxelize --label 3 in.cut -o out.vdb
      [[ ! -e out.vdb ]] || fail "a prefix of $n bytes left a file"
    done
  done
  rm in.cut
}

# A few bytes that unpack to gigabytes, in voxels so oblong that the lattice would take 50 GB: the header is enough.
test_a_volume_too_large_is_refused_by_its_header() {
  python3 - <<'E2'
import gzip, struct
head = bytearray(352)
struct.pack_into('<i', head, 0, 348)
struct.pack_into('<8h', head, 40, 3, 1600, 1600, 1600, 1, 1, 1, 1)
struct.pack_into('<hh', head, 70, 2, 8)
struct.pack_into('<8f', head, 76, 1, 1, 1, 5e5, 0, 0, 0, 0)
struct.pack_into('<f', head, 108, 352)
struct.pack_into('<h', head, 254, 1)
for row, column, value in ((0, 0, 1), (1, 1, 1), (2, 2, 5e5)):
    struct.pack_into('<f', head, 280 + 16 * row + 4 * column, value)
head[344:348] = b'n+1\0'
open('in.nii.gz', 'wb').write(gzip.compress(bytes(head)))
E2
  voxelize --label 1 --max-memory 8G in.nii.gz >out 2>message && fail 'it is not refused'
  grep -qx 'voxelize: in.nii.gz: the lattice of the labels needs .* GiB, the limit is 8.0 GiB (--max-memory)' message ||
    fail "$(<message)"
  # Where it could be done, the voxels are missed.
  voxelize --label 1 --max-memory 200G in.nii.gz >out 2>message && fail 'the voxels are not missed'
  grep -qx 'voxelize: in.nii.gz: ends after 0 of 4096000000 bytes of voxels (1600 x 1600 x 1600)' message || fail "$(<message)"
  rm in.nii.gz out message
}

# Tetrahedra with the labels of a volume as materials against that volume, read by numpy alone: each has the label of
# the voxel at its centroid, or else of the nearest voxel with a label: with any (RULE any), or with a wanted one
# (wanted). The volume of each label is that of its voxels but for TOLERANCE. Labels that touch share faces, and the mesh has no boundary between them: no face of
# one tetrahedron alone lies among voxels of the labels, and none is in three.
check_materials() { # MESH.mesh LABELS.nii.gz RULE TOLERANCE LABEL...
  cat >materials.py <<'END'
import gzip, struct, sys
import numpy as np

name, volume, rule, tolerance, *wanted = sys.argv[1:]
wanted = [int(w) for w in wanted]
raw = gzip.open(volume).read()
size = struct.unpack_from('<3h', raw, 42)
kind = {2: np.uint8, 4: np.int16, 8: np.int32, 512: np.uint16}[struct.unpack_from('<h', raw, 70)[0]]
assert struct.unpack_from('<h', raw, 254)[0] > 0, 'no sform'
affine = np.vstack([np.frombuffer(raw, '<f4', 12, 280).reshape(3, 4).astype(float), [0, 0, 0, 1]])
offset = int(struct.unpack_from('<f', raw, 108)[0])
labels = np.frombuffer(raw, kind, size[0] * size[1] * size[2], offset).reshape(size, order='F').astype(int)

text = open(name).read()
def table(key, columns):
    begin = text.index('\n' + key + '\n') + len(key) + 2
    begin = text.index('\n', begin)
    end = min(n for n in (text.find(w, begin) for w in ('Vert', 'Tetra', 'Tri', 'End')) if n >= 0)
    return np.fromstring(text[begin:end], sep=' ').reshape(-1, columns)
points = table('Vertices', 4)[:, :3]
rows = table('Tetrahedra', 5).astype(int)
corners, material = rows[:, :4] - 1, rows[:, 4]

inverse = np.linalg.inv(affine)
padded = np.pad(labels, 6)
def voxels(p):
    """Which voxel of `padded` a place is in, and whether that is clear."""
    index = p @ inverse[:3, :3].T + inverse[:3, 3]
    whole = np.clip(np.floor(index + 0.5).astype(int), -3, np.array(size) + 2)
    return whole + 6, np.abs(index - np.floor(index) - 0.5).min(1) > 1e-9
centroids = points[corners].mean(1)
at, clear = voxels(centroids)
expected = padded[tuple(at.T)]
among = wanted if rule == 'wanted' else np.setdiff1d(labels, [0])
other = ~np.isin(expected, among)
least = np.full((len(among), other.sum()), np.inf) # distance of each label
for offset in np.ndindex(7, 7, 7):
    voxel = at[other] + np.array(offset) - 3
    label = padded[tuple(voxel.T)]
    d = np.linalg.norm((voxel - 6) @ affine[:3, :3].T + affine[:3, 3] - centroids[other], axis=1)
    for n, w in enumerate(among):
        least[n] = np.where(label == w, np.minimum(d, least[n]), least[n])
assert other.sum() > 0 and least.min(0).max() < np.inf
expected[other] = np.array(among)[least.argmin(0)]
order = np.sort(np.vstack([least, np.full(other.sum(), 1e9)]), 0)
clear[other] &= order[1] - order[0] > 1e-6
assert clear.mean() > 0.99
bad = (expected != material)[clear].sum()
assert bad == 0, '%d of %d tetrahedra have another material than the nearest label' % (bad, len(material))

p = points[corners]
volumes = np.einsum('ij,ij->i', np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0]) / 6
voxel = abs(np.linalg.det(affine[:3, :3]))
share = np.isin(material, wanted).mean()
print('share of tetrahedra with these labels: %.4f' % share)
for w in wanted:
    ratio = volumes[material == w].sum() / ((labels == w).sum() * voxel)
    print('label %d: %d tetrahedra, volume %+.2f %%' % (w, (material == w).sum(), 100 * (ratio - 1)))
    assert abs(ratio - 1) <= float(tolerance), ratio
assert share >= (1 if rule == 'wanted' else 0.95), share

faces = np.sort(np.concatenate([corners[:, [k for k in range(4) if k != o]] for o in range(4)]), 1)
owner = np.tile(np.arange(len(corners)), 4)
key = (faces[:, 0] * len(points) + faces[:, 1]) * len(points) + faces[:, 2]
order = np.argsort(key, kind='stable')
same = key[order][1:] == key[order][:-1]
assert not (same[1:] & same[:-1]).any(), 'a face in three tetrahedra'
a, b = material[owner[order][:-1][same]], material[owner[order][1:][same]]
for low, high in [(v, w) for v in wanted for w in wanted if v < w]:
    touching = sum((np.moveaxis(labels, axis, 0)[:-1] == v)[(np.moveaxis(labels, axis, 0)[1:] == w)].sum()
                   for axis in range(3) for v, w in ((low, high), (high, low)))
    shared = ((np.minimum(a, b) == low) & (np.maximum(a, b) == high)).sum()
    print('labels %d and %d: %d faces of voxels, %d of tetrahedra' % (low, high, touching, shared))
    assert (shared > 0) == (touching > 0)

single = np.ones(len(order), bool)
single[1:] &= ~same
single[:-1] &= ~same
middle, _ = voxels(points[faces[order][single]].mean(1))
union = np.isin(padded, wanted)
inside = np.ones(single.sum(), bool)
for i in (-1, 0, 1):
    for j in (-1, 0, 1):
        for k in (-1, 0, 1):
            inside &= union[tuple((middle + [i, j, k]).T)]
assert inside.sum() == 0, '%d faces of the boundary lie within the labels' % inside.sum()
END
  python3 -c 'import numpy' 2>/dev/null || skip 'no numpy for python3'
  python3 materials.py "$@" || fail "materials of $*"
  rm materials.py
}

test_materials_of_the_liver() {
  local data=$GEWEBE_SHARED/data/ts_abdomen_seg_3mm.nii.gz
  [[ -f $data ]] || skip 'no data'
  voxelize --label 5 "$data" | mc-opt -q --tets --cell 4 --materials "$data" -o liver.mesh 2>/dev/null
  check_materials liver.mesh "$data" any 0.03 5
}

# Cells of 4 mm over voxels of 3 mm: gallbladder, liver, stomach, colon, each pair of three touching.
test_materials_of_touching_organs() {
  local data=$GEWEBE_SHARED/data/ts_abdomen_seg_3mm.nii.gz labels
  [[ -f $data ]] || skip 'no data'
  for labels in 4,5 5,6,20; do
    voxelize --label $labels "$data" |
      mc-opt -q --tets --cell 4 --materials "$data" --label $labels -o organs.mesh 2>/dev/null
    # shellcheck disable=SC2086 # words
    check_materials organs.mesh "$data" wanted 0.01 ${labels//,/ }
    rm organs.mesh
  done
}

# Labels on axes that are turned, mirrored, oblong and a little oblique; two of them touch, and a third fills a corner.
test_materials_of_turned_labels() {
  python3 -c 'import numpy' 2>/dev/null || skip 'no numpy for python3'
  python3 - <<'END'
import gzip, struct
import numpy as np
size = (40, 36, 24)
i, j, k = np.meshgrid(*map(np.arange, size), indexing='ij')
labels = np.zeros(size, np.uint8)
labels[((i - 17) / 13) ** 2 + ((j - 17) / 12) ** 2 + ((k - 11) / 8) ** 2 < 1] = 4
labels[(labels == 4) & (i + j > 38)] = 7
labels[(labels == 4) & (k < 8) & (j < 14)] = 9
c, s = np.cos(0.4), np.sin(0.4)
turn = np.array([[c, -s, 0], [s * c, c * c, -s], [s * s, s * c, c]])
matrix = turn @ np.diag([-1.5, 1.2, 2.0]) @ np.array([[1, 0.002, 0], [0, 1, 0], [0.001, 0, 1]])
head = bytearray(352)
struct.pack_into('<i', head, 0, 348)
struct.pack_into('<8h', head, 40, 3, *size, 1, 1, 1, 1)
struct.pack_into('<hh', head, 70, 2, 8)
struct.pack_into('<8f', head, 76, 1, 1.5, 1.2, 2, 0, 0, 0, 0)
struct.pack_into('<f', head, 108, 352)
head[123] = 2
struct.pack_into('<h', head, 254, 1)
for row in range(3):
    struct.pack_into('<4f', head, 280 + 16 * row, *matrix[row], (-31, 52, 170)[row])
head[344:348] = b'n+1\0'
open('in.nii.gz', 'wb').write(gzip.compress(bytes(head) + labels.tobytes(order='F')))
END
  voxelize --label 4,7,9 in.nii.gz | mc-opt --tets --cell 1.2 --materials in.nii.gz -o in.mesh
  check_materials in.mesh in.nii.gz any 0.03 4 7 9
  voxelize --label 4-9 in.nii.gz | mc-opt --tets --cell 1.2 --materials in.nii.gz --label 4-9 -o in.mesh
  check_materials in.mesh in.nii.gz wanted 0.03 4 7 9
  rm in.nii.gz in.mesh
}

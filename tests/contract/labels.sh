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

"""PLY, as gewebe_mesh(5) and gewebe_tetmesh(5) have it, as views of numpy: nothing is copied."""
import io
import mmap

import numpy

from .errors import Error

_TYPES = {
    'char': 'i1', 'int8': 'i1', 'uchar': 'u1', 'uint8': 'u1', 'short': 'i2', 'int16': 'i2', 'ushort': 'u2', 'uint16': 'u2',
    'int': 'i4', 'int32': 'i4', 'uint': 'u4', 'uint32': 'u4', 'float': 'f4', 'float32': 'f4', 'double': 'f8', 'float64': 'f8',
}
_NAMES = {'i1': 'char', 'u1': 'uchar', 'i2': 'short', 'u2': 'ushort', 'i4': 'int', 'u4': 'uint', 'f4': 'float', 'f8': 'double'}


class Ply:
    """A mesh. elements holds a structured array for each element of the file, by name, with a field for each property;
    a list whose length is the same in all rows is a field of that many numbers."""

    def __init__(self, elements, comments=()):
        self.elements = elements
        self.comments = list(comments)

    @property
    def points(self):
        """[n, 3], mm: a view of x, y, z."""
        return _columns(self.elements['vertex'], ('x', 'y', 'z'))

    @property
    def normals(self):
        """[n, 3], or None."""
        vertex = self.elements['vertex']
        return _columns(vertex, ('nx', 'ny', 'nz')) if 'nx' in vertex.dtype.names else None

    @property
    def triangles(self):
        """[t, 3]: a view of the faces' corners, none where there are no faces."""
        face = self.elements.get('face')
        if face is None or len(face) == 0:
            return numpy.empty((0, 3), 'i4')
        name = 'vertex_indices' if 'vertex_indices' in face.dtype.names else 'vertex_index'
        if face.dtype[name].shape != (3,):
            raise Error('faces of other than three corners')
        return face[name]

    @property
    def tetrahedra(self):
        """[m, 4 or 10]: a view of the elements' nodes, none where there are no tetrahedra."""
        tetrahedron = self.elements.get('tetrahedron')
        if tetrahedron is None or len(tetrahedron) == 0:
            return numpy.empty((0, 4), 'i4')
        return tetrahedron['vertex_indices']

    def to_bytes(self):
        """The file."""
        file = io.BytesIO()
        write_ply(file, self)
        return file.getvalue()


def _columns(array, names):
    """Fields that stand side by side, of one type, as the columns of a view."""
    types = {array.dtype[name] for name in names}
    first = array.dtype.fields[names[0]][1]
    kind = types.pop()
    if types or [array.dtype.fields[name][1] for name in names] != [first + k * kind.itemsize for k in range(len(names))]:
        return numpy.stack([array[name] for name in names], axis=1)
    return numpy.ndarray((len(array), len(names)), kind, array, first, (array.dtype.itemsize, kind.itemsize))


def _header(file, name):
    if file.readline().rstrip() != b'ply':
        raise Error(f'{name}: no PLY')
    order, elements, comments = None, [], []
    for line in iter(file.readline, b''):
        word, *rest = line.decode('latin-1').split() or ['']
        if word == 'format':
            if rest[0] not in ('binary_little_endian', 'binary_big_endian'):
                raise Error(f'{name}: PLY as {rest[0]}, expected a binary one; mc-opt and exp2ela write that')
            order = '<' if rest[0] == 'binary_little_endian' else '>'
        elif word == 'element':
            elements.append((rest[0], int(rest[1]), []))
        elif word == 'property':
            elements[-1][2].append(rest)
        elif word == 'comment':
            comments.append(line.decode('latin-1').strip()[8:])
        elif word == 'end_header':
            if order is None:
                raise Error(f'{name}: a header without a format')
            return order, elements, comments
    raise Error(f'{name}: ends within its header')


def _dtype(data, at, order, properties, name):
    """Of one element. Lists have the length that they have in the first row, 3 where there is none (data is None)."""
    fields = []
    offset = 0
    for property in properties:
        if property[0] == 'list':
            count = numpy.dtype(order + _TYPES[property[1]])
            if data is not None and at + offset + count.itemsize > len(data):
                raise Error(f'{name}: ends within its elements')
            length = 3 if data is None else int(numpy.frombuffer(data, count, 1, at + offset)[0])
            fields += [(f'{property[3]} count', count), (property[3], order + _TYPES[property[2]], (length,))]
        else:
            fields.append((property[1], order + _TYPES[property[0]]))
        offset = numpy.dtype(fields).itemsize
        if data is not None and at + offset > len(data):
            raise Error(f'{name}: ends within its elements')
    return numpy.dtype(fields)


def read_ply(source):
    """The mesh of a file, by its path, or of bytes. Files are mapped: only what is looked at is read."""
    if isinstance(source, (bytes, bytearray, memoryview)):
        name, data = 'PLY', source
        head = io.BytesIO(data)
        order, described, comments = _header(head, name)
        at = head.tell()
    else:
        name = str(source)
        with open(source, 'rb') as file:
            order, described, comments = _header(file, name)
            at = file.tell()
            data = mmap.mmap(file.fileno(), 0, prot=mmap.PROT_READ)
    elements = {}
    for element, count, properties in described:
        if count == 0:
            elements[element] = numpy.empty(0, _dtype(None, 0, order, properties, name))
            continue
        dtype = _dtype(data, at, order, properties, name)
        if count * dtype.itemsize > len(data) - at:
            raise Error(f'{name}: {count} of {element} in {len(data) - at} bytes, expected a count that fits')
        rows = numpy.frombuffer(data, dtype, count, at)
        for field in dtype.names:
            if field.endswith(' count') and (rows[field] != dtype[field[:-6]].shape[0]).any():
                raise Error(f'{name}: {element} with lists of different lengths, expected one; voxelize and exp2ela read those')
        elements[element] = rows
        at += count * dtype.itemsize
    return Ply(elements, comments)


def write_ply(target, mesh=None, *, points=None, triangles=None):
    """Writes a mesh, or points [n, 3] with triangles [t, 3], in mm, to a path or an open file."""
    if mesh is None:
        mesh = _mesh_of(points, triangles)
    lines = ['ply', 'format binary_little_endian 1.0', *(f'comment {text}' for text in mesh.comments)]
    rows = []
    for element, array in mesh.elements.items():
        lines.append(f'element {element} {len(array)}')
        fields = []
        for field in array.dtype.names:
            if field.endswith(' count'):
                fields.append((field, '<' + array.dtype[field].str[1:]))
                continue
            kind = array.dtype[field].base.str[1:]
            if array.dtype[field].shape:
                lines.append(f'property list {_NAMES[array.dtype[field + " count"].str[1:]]} {_NAMES[kind]} {field}')
            else:
                lines.append(f'property {_NAMES[kind]} {field}')
            fields.append((field, '<' + kind, array.dtype[field].shape))
        rows.append(numpy.ascontiguousarray(array.astype(fields)))
    data = ('\n'.join([*lines, 'end_header']) + '\n').encode('latin-1')
    if hasattr(target, 'write'):
        _write(target, data, rows)
    else:
        with open(target, 'wb') as file:
            _write(file, data, rows)


def _write(file, head, rows):
    file.write(head)
    for array in rows:
        file.write(array.tobytes())


def _mesh_of(points, triangles):
    points = numpy.asarray(points, float)
    triangles = numpy.asarray(triangles)
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError('expected points [n, 3] and triangles [t, 3]')
    if len(triangles) and not (0 <= triangles.min() and triangles.max() < len(points)):
        raise ValueError('a corner that is no point')
    vertex = numpy.empty(len(points), [('x', '<f8'), ('y', '<f8'), ('z', '<f8')])
    for k, axis in enumerate('xyz'):
        vertex[axis] = points[:, k]
    face = numpy.empty(len(triangles), [('vertex_indices count', 'u1'), ('vertex_indices', '<i4', (3,))])
    face['vertex_indices count'] = 3
    face['vertex_indices'] = triangles
    return Ply({'vertex': vertex, 'face': face})

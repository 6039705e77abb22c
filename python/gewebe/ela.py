"""Models of ela_expl(5)."""
import shlex

import numpy

from .errors import Error

# Sections whose lines are numbers alone.
_PLAIN = {
    'normals': float, 'triangles': numpy.uint32, 'texcoords': float, 'tetrahedra': numpy.int64,
    'skin': float, 'skin_triangles': numpy.int64, 'skin_texcoords': float,
}


class Model:
    """A deformable object. Units are mm, g and s; stiffness g/s² (1e-3 N/m).

    name; materials, a list of dictionaries; points [n, 3], mass [n], drag [n]; fixed [n, 3], true for each axis that is
    held; central [n], the central node of each or -1; node_material [n]; springs, a structured array of i, j, kind
    (b'e', b'b', b'c'), stiffness, damping, rest; triangles [t, 3]; and where there are any normals, texcoords,
    tetrahedra [m, 4 or 10], tetrahedron_material [m], skin, skin_triangles, skin_texcoords as in the file, else None.
    space is 'RAS', 'LPS' or None.
    """

    def __init__(self, name):
        self.name = name
        self.space = None
        self.normals = self.triangles = self.texcoords = self.tetrahedra = self.tetrahedron_material = None
        self.skin = self.skin_triangles = self.skin_texcoords = None


def _take_materials(model, rows):
    model.materials = []
    for row in rows:
        _, name, *numbers = shlex.split(row)
        names = ('density', 'young', 'thickness', 'damping_ratio', 'poisson')
        model.materials.append({'name': name, **{key: float(value) for key, value in zip(names, numbers)}})


def _take_nodes(model, rows):
    words = [row.split() for row in rows]
    model.points = numpy.array([row[:3] for row in words], float).reshape(-1, 3)
    model.mass = numpy.array([row[3] for row in words], float)
    model.drag = numpy.array([row[4] for row in words], float)
    model.fixed = numpy.array([[axis in row[5] for axis in 'xyz'] for row in words], bool).reshape(-1, 3)
    model.central = numpy.array([row[6] for row in words], numpy.int64)
    model.node_material = numpy.array([row[7] for row in words], numpy.int64)


def _take_springs(model, rows):
    kinds = [('i', 'u4'), ('j', 'u4'), ('kind', 'S1'), ('stiffness', 'f8'), ('damping', 'f8'), ('rest', 'f8')]
    model.springs = numpy.array([tuple(row.split()) for row in rows], kinds)


def _take_plain(model, section, rows):
    numbers = numpy.array([row.split() for row in rows], _PLAIN[section])
    if section == 'tetrahedra':
        model.tetrahedra, model.tetrahedron_material = numbers[:, :-1].astype(numpy.uint32), numbers[:, -1]
    else:
        setattr(model, section, numbers)


def read_ela(source):
    """The model of a file, by its path, or of bytes as exp2ela writes them."""
    if isinstance(source, (bytes, bytearray)):
        place, text = 'model', source.decode()
    else:
        place = str(source)
        with open(source, encoding='utf-8') as file:
            text = file.read()
    # A name holds no #.
    lines = [line for line in (whole.split('#', 1)[0].strip() for whole in text.splitlines()) if line]
    try:
        if lines[0].split() != ['ela_expl', '1']:
            raise Error(f'{place}: no model of ela_expl(5), version 1')
        model, at = Model(shlex.split(lines[1])[1]), 2
        if lines[at].split()[0] == 'space':
            model.space, at = lines[at].split()[1], at + 1
        while lines[at] != 'end':
            section, count = lines[at].split()
            rows = lines[at + 1:at + 1 + int(count)]
            if len(rows) != int(count):
                raise Error(f'{place}: ends within its {section}')
            at += 1 + int(count)
            if section == 'materials':
                _take_materials(model, rows)
            elif section == 'nodes':
                _take_nodes(model, rows)
            elif section == 'springs':
                _take_springs(model, rows)
            elif section in _PLAIN:
                _take_plain(model, section, rows)
            else:
                raise Error(f'{place}: no section {section!r} in ela_expl(5)')
    except (IndexError, ValueError) as error:
        raise Error(f'{place}: broken, see what ffe-run says of it ({error})') from error
    return model

"""Results of a run, gewebe_results(5), by h5py."""
from .hdf5 import File


class Results(File):
    """A file of results, open for reading: a mapping from names of objects to Moved. A context manager.

    time [F] holds the time of each frame in s, instruments the groups of the file by name.
    """

    def __init__(self, path):
        super().__init__(path, 'gewebe_results', 'results of a run')
        self.time = self.file['time'][:]
        self.instruments = self.file.get('instruments', {})

    def __iter__(self):
        objects = self.file['objects']
        return iter(sorted(objects, key=lambda name: int(objects[name].attrs['order'])))

    def __len__(self):
        return len(self.file['objects'])

    def __getitem__(self, name):
        return Moved(self.file['objects'][name], len(self.time))


class Moved:
    """One object over the frames. Frames are numbered as those of the file, negative ones from the end."""

    def __init__(self, group, frames):
        self.group, self.frames = group, frames
        self.first = int(group.attrs.get('first_frame', 0))
        cuts = group.get('cuts', {})
        parts = [cuts[name] for name in sorted(cuts, key=int)]
        # From each of these frames on the object is as that group has it.
        self._parts = [(self.first, group)] + [(int(part.attrs['first_frame']), part) for part in parts]

    def _at(self, frame):
        """The group that holds the frame, the frame's number, and its row there."""
        asked = frame
        if frame < 0:
            frame += self.frames
        if not self.first <= frame < self.frames:
            raise IndexError(f'frame {asked} of an object that is there from {self.first} to {self.frames - 1}')
        first, group = [part for part in self._parts if part[0] <= frame][-1]
        return group, frame, frame - first

    def points(self, frame=0):
        """Rest positions of the nodes of the frame, [n, 3] in mm."""
        return self._at(frame)[0]['points'][:]

    def displacement(self, frame=-1):
        """[n, 3], mm."""
        group, _, row = self._at(frame)
        return group['displacement'][row]

    def shape(self, frame=-1):
        """Positions of the nodes, [n, 3] in mm."""
        return self.points(frame) + self.displacement(frame)

    def triangles(self, frame=-1):
        return self._at(frame)[0]['triangles'][:]

    def tetrahedra(self, frame=-1):
        """Nodes of each tetrahedron of a solid, else None."""
        group = self._at(frame)[0]
        return group['tetrahedra'][:] if 'tetrahedra' in group else None

    def field(self, name, frame=-1):
        """stress, strain, von_mises, or element_stress and so on, if the scene emits the stress of the solid, else None."""
        group, number, _ = self._at(frame)
        if 'fields' not in group or name not in group['fields']:
            return None
        row = number - int(group['fields'].attrs['first_frame'])
        return group['fields'][name][row] if row >= 0 else None

"""Gewebe's HDF5 files, read by h5py."""
from .errors import Error


class File:
    """A file of one format, open for reading. A context manager."""

    def __init__(self, path, kind, what):
        import h5py

        self.file = h5py.File(path, 'r')
        if self.file.attrs.get('format') not in (kind, kind.encode()):
            self.file.close()
            raise Error(f'{path}: no {what}')

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.file.close()

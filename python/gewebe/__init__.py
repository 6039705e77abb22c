"""Programs that model soft tissue, their pipes, their files and their running scenes from Python: gewebe_python(7).

    import gewebe

    surface = gewebe.run('metaball2vol --voxel 1', 'mc-opt', input='0 0 0 20').mesh()
    surface.points.mean(axis=0), surface.triangles
"""
from .ela import Model, read_ela
from .errors import Error
from .ply import Ply, read_ply, write_ply
from .programs import Outcome, path_of, run
from .results import Results
from .serve import Driven, Scene, Shapes, drive
from .store import Store

__all__ = [
    'Driven', 'Error', 'Model', 'Outcome', 'Ply', 'Results', 'Scene', 'Shapes', 'Store',
    'drive', 'path_of', 'read_ela', 'read_ply', 'run', 'write_ply',
]

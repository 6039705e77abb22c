"""Programs that model soft tissue, their pipes, their files and their running scenes from Python: gewebe_python(7).

    import gewebe

    surface = gewebe.run('metaball2vol --voxel 1', 'mc-opt', input='0 0 0 20').mesh()
    surface.points.mean(axis=0), surface.triangles
"""
from .answers import Answer, Estimate, Forces, Instrument, Stress, read_answers
from .ela import Model, read_ela
from .errors import Error
from .ply import Ply, read_ply, write_ply
from .programs import Outcome, path_of, run
from .results import Results
from .serve import Driven, Scene, Shapes, drive, scene_line
from .store import Store

__all__ = [
    'Answer', 'Driven', 'Error', 'Estimate', 'Forces', 'Instrument', 'Model', 'Outcome', 'Ply', 'Results', 'Scene', 'Shapes',
    'Store', 'Stress', 'drive', 'path_of', 'read_answers', 'read_ela', 'read_ply', 'run', 'scene_line', 'write_ply',
]

"""Drives ffe-run by its socket, reads shapes in shared memory: drive.py SOCKET SHAPES, see README.md."""
import sys

import numpy

from gewebe import Scene, Shapes

WALL = '"y>6 and z>34 and z<46"'


def force(scene):
    """On the tool, in N."""
    for line in scene.ask('instruments'):
        if line[0] == 'tool':
            x, y, z = map(float, line[14:17])
            return (x * x + y * y + z * z) ** 0.5 / 1e6
    sys.exit('no tool')


def moved(rest, places):
    """How far nodes are from where they rest, their mean in mm."""
    return numpy.linalg.norm(places - rest, axis=1).mean()


def main(socket_path, shapes_path):
    scene = Scene(socket_path)
    shapes = Shapes(shapes_path)

    # Grasp: nodes of the wall follow the tool.
    scene.ask('object vessel vessel.ela', 'gravity 0 -9810 0', 'instrument tool sphere 3 0 14 40')
    rest = scene.ask('nodes vessel rest')
    grasped = scene.ask(f'select vessel {WALL}')
    print(f'The vessel has {rest[0][2]} nodes, the tool grasps {grasped[0][2]} of them.')
    scene.ask(f'grasp vessel {WALL} tool', 'move tool 0 19 40 over 0.5', 'run 1 every 0.02')
    print(f'Pulled by 5 mm it pulls back by {force(scene):.4f} N,')
    places = numpy.array(rest[1:], float)
    print(f'its nodes have moved by {moved(places, shapes.last()["vessel"]):.4f} mm.')

    # Cut: what is between two planes comes off and hangs on the tool.
    for line in scene.ask('cut vessel plane 0 0 28 0 0 1', 'cut vessel plane 0 0 52 0 0 1', 'step 0.02'):
        if line[0] == 'cut':
            print(f'A cut opens it at {line[5]} nodes,')
        if line[0] == 'part':
            print(f'{line[2]} comes off with {line[4]} nodes.')

    # Reconnect: the scene stays as it is.
    scene.close()
    scene = Scene(socket_path)
    print(f'At {scene.time:.2f} s I am back,')
    scene.ask('move tool 0 34 40 over 0.5')
    for _ in range(150):
        scene.ask('step 0.02')
    now = float(scene.ask('sync')[0][1])
    objects = scene.ask('objects')
    print(f'at {now:.2f} s there are {objects[0][1]} objects.')
    print(f'The tool carries {force(scene):.4f} N,')
    for name, places in shapes.last().items():
        print(f'{name} reaches from {places[:, 1].min():.3f} to {places[:, 1].max():.3f} mm.')
    scene.ask('end')


main(*sys.argv[1:])

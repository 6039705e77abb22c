"""Drives ffe-run by its socket, reads shapes in shared memory: drive.py SOCKET SHAPES, see README.md."""
import mmap
import socket
import struct
import sys
import time

WALL = '"y>6 and z>34 and z<46"'


class Scene:
    """A client of ffe-run --serve --ack --listen: gewebe_serve(5)."""

    def __init__(self, path):
        for _ in range(200):  # the run may not listen yet
            try:
                self.socket = socket.socket(socket.AF_UNIX)
                self.socket.connect(path)
            except (FileNotFoundError, ConnectionRefusedError):
                time.sleep(0.05)
                continue
            self.answers = self.socket.makefile('r')
            word, *more = self.answers.readline().split()
            if word == 'ready':
                self.time = float(more[0])
                self.number = 0  # of lines that were sent
                return
            time.sleep(0.05)  # busy: the client before is on its way out
        sys.exit(f'{path}: nobody lets me in')

    def send(self, line):
        self.number += 1
        self.socket.sendall((line + '\n').encode())

    def ask(self, *lines):
        """Sends all lines at once, then collects what they are answered until the last one is done."""
        for line in lines:
            self.send(line)
        said = []
        for line in self.answers:
            word, *more = line.split()
            if word == 'error':
                sys.exit(line.strip())
            if word == 'ok':
                if int(more[0]) == self.number:
                    return said
            else:
                said.append([word, *more])
        sys.exit('the connection ended')

    def close(self):
        self.answers.close()
        self.socket.close()


class Shapes:
    """The file of --shapes-in. Words are of 64 bits, so that each is one load."""

    def __init__(self, path):
        self.file = open(path, 'rb')
        self.map()
        if bytes(self.memory[:8]) != b'GWBSHAPE' or self.words[1] != 1:
            sys.exit(f'{path}: no shapes, or of another version')

    def map(self):
        self.memory = memoryview(mmap.mmap(self.file.fileno(), 0, prot=mmap.PROT_READ))
        self.words = self.memory.cast('Q')

    def last(self):
        """Coordinates of all nodes by name of the object, of the last answer."""
        while True:
            sequence = self.words[3]
            place = 4 + sequence % 2 * 2
            start, size = self.words[place], self.words[place + 1]
            if start + size > len(self.memory):  # the file has grown
                self.map()
                continue
            frame = bytes(self.memory[start:start + size])
            if self.words[2] < sequence + 2:  # else it was overwritten meanwhile
                break
        shapes = {}
        for k in range(struct.unpack_from('<Q', frame, 32)[0]):
            name, length, positions, nodes = struct.unpack_from('<4Q', frame, 64 + 32 * k)
            shapes[frame[name:name + length].decode()] = struct.unpack_from(f'<{3 * nodes}d', frame, positions)
        return shapes


def force(scene):
    """On the tool, in N."""
    for line in scene.ask('instruments'):
        if line[0] == 'tool':
            x, y, z = map(float, line[14:17])
            return (x * x + y * y + z * z) ** 0.5 / 1e6
    sys.exit('no tool')


def moved(rest, places):
    """How far nodes are from where they rest, their mean in mm."""
    total = 0.0
    for k in range(0, len(rest), 3):
        x, y, z = (places[k + a] - rest[k + a] for a in range(3))
        total += (x * x + y * y + z * z) ** 0.5
    return total / (len(rest) // 3)


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
    places = [float(x) for line in rest[1:] for x in line]
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
    for name, all in shapes.last().items():
        print(f'{name} reaches from {min(all[1::3]):.3f} to {max(all[1::3]):.3f} mm.')
    scene.ask('end')


main(*sys.argv[1:])

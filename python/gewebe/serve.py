"""Running scenes, gewebe_serve(5): ffe-run --serve, driven through a socket, with shapes in shared memory."""
from __future__ import annotations

import io
import mmap
import os
import socket
import struct
import subprocess
import tempfile
import time

from typing import Any

import numpy

from .answers import Answer, read_answers
from .ela import read_ela
from .errors import Error
from .ply import write_ply
from .programs import path_of, run


def _word(value: Any) -> str:
    """A word of a scene line: numbers exactly, others in quotes where they need them."""
    if isinstance(value, (bool, numpy.bool_)):
        raise ValueError(f'{value} is no word of a scene')
    if isinstance(value, (int, numpy.integer)):
        return str(int(value))
    if isinstance(value, (float, numpy.floating)):
        if not numpy.isfinite(value):
            raise ValueError(f'{value} in a line, expected finite numbers')
        return repr(float(value))
    text = os.fspath(value)
    if '"' in text or '\n' in text:
        raise ValueError(f'{text!r} in a line, expected no double quote and no end of line')
    return f'"{text}"' if not text or any(c in text for c in ' \t#') else text


def scene_line(*words: Any) -> str:
    """A line of a scene, scene(5), of words, paths, numbers and arrays of numbers:
    scene_line('displace', 'ball', 'z>48', numpy.array([0, 0, 3.]))."""
    parts: list[str] = []
    for word in words:
        if isinstance(word, (numpy.ndarray, list, tuple)):
            parts += [_word(number) for number in word]
        else:
            parts.append(_word(word))
    return ' '.join(parts)


class Scene:
    """A running scene: objects come by add, commands by tell, time goes on by step and run.

    Scene() starts a run of its own, as drive() does; Scene(path) is a client of ffe-run --serve --ack --listen PATH.
    time is the time of the scene in s at the connection. A context manager; notebooks show it as a picture.
    """

    _ended = False
    _cwd: str | os.PathLike[str] | None = None  # where paths in lines count from, if not from here

    def __new__(cls, path: str | os.PathLike[str] | None = None, *args: Any, **more: Any) -> Scene:
        return super().__new__(Driven if cls is Scene and path is None else cls)

    def __init__(self, path, patience=10.0):
        self._surfaces: dict[str, numpy.ndarray] = {}
        until = time.monotonic() + patience
        while time.monotonic() < until:
            self.socket = socket.socket(socket.AF_UNIX)
            try:
                self.socket.connect(os.fspath(path))
            except (FileNotFoundError, ConnectionRefusedError):  # the run may not listen yet
                self.socket.close()
                time.sleep(0.02)
                continue
            self.answers = self.socket.makefile('r')
            word, *more = self.answers.readline().split() or ['']
            if word == 'ready':
                self.time = float(more[0])
                self.number = 0  # of lines that were sent
                return
            self._leave()
            time.sleep(0.02)  # busy: the client before is on its way out
        raise Error(f'{path}: nobody lets me in')

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _leave(self):
        self._ended = True
        self.answers.close()
        self.socket.close()

    def close(self):
        """Disconnects; the scene stays as it is."""
        self._leave()

    def send(self, line):
        if '\n' in line:
            raise ValueError('more than one line')
        if self._ended:
            raise Error('the scene is closed, expected an open one')
        self.number += 1
        self.socket.sendall((line + '\n').encode())

    def ask(self, *lines):
        """Sends all lines at once and returns the lines of their answers as lists of words. Raises Error with the message of the
        first refused line, once all are answered."""
        if not lines:
            return []
        for line in lines:
            self.send(line)
        said, refused = [], None
        for line in self.answers:
            word, *more = line.split()
            if word == 'error':
                number = int(more[0].rstrip(':'))
                refused = refused or line.strip()
            elif word == 'ok':
                number = int(more[0])
            else:
                said.append([word, *more])
                continue
            if number == self.number or number == 0:
                if refused:
                    raise Error(refused)
                return said
        raise Error(refused or 'the connection ended')

    def tell(self, *words: Any) -> None:
        """Carries out one command: scene.tell('displace', 'ball', 'near:0,0,50,5', 0, 0, 3). Raises Error if it is refused."""
        self.ask(scene_line(*words))

    def add(self, name: str, model: str | os.PathLike[str], *words: Any, **settings: Any) -> None:
        """Adds an object: the file of its model, further words, and settings: scene.add('ball', 'ball.ela', method='ffe')."""
        path = os.path.join(self._cwd or '', model)
        self.tell('object', name, model, *words, *(f'{key}={value}' for key, value in settings.items()))
        self._surfaces[name] = read_ela(path).triangles

    def step(self, dt: float | None = None) -> Answer:
        """Goes on by dt seconds (default: that of scene(5)) and returns the answer as arrays."""
        return self._answers(self.ask('step' if dt is None else scene_line('step', float(dt))))[-1]

    def run(self, until: float, every: float) -> list[Answer]:
        """Goes on to the time `until` in steps of `every` seconds and returns their answers."""
        return self._answers(self.ask(scene_line('run', float(until), 'every', float(every))))

    def _answers(self, lines: list[list[str]]) -> list[Answer]:
        answers = read_answers(lines)
        for answer in answers:
            for name, triangles in answer.triangles.items():
                self._surfaces[name] = triangles
            for word, name, *_ in answer.events:
                if word in ('cut', 'restored') and name not in answer.triangles:
                    self._surfaces.pop(name, None)  # unknown: shapes are not emitted
        return answers


class Shapes:
    """The file of ffe-run --shapes-in."""

    def __init__(self, path):
        self.file = open(path, 'rb')
        self._map()
        # Words are of 64 bits, so that each is one load.
        if bytes(self.memory[:8]) != b'GWBSHAPE' or self.words[1] != 1:
            raise Error(f'{path}: no shapes, or of another version')

    def _map(self):
        self.memory = memoryview(mmap.mmap(self.file.fileno(), 0, prot=mmap.PROT_READ))
        self.words = self.memory.cast('Q')

    def close(self):
        self.file.close()

    def last(self):
        """Positions of all nodes, [n, 3] in mm, by object, of the last answer; empty before the first."""
        while True:
            sequence = self.words[3]
            if sequence == 0:
                return {}
            place = 4 + sequence % 2 * 2
            start, size = self.words[place], self.words[place + 1]
            if start + size > len(self.memory):  # the file has grown
                self._map()
                continue
            frame = bytes(self.memory[start:start + size])
            if self.words[2] < sequence + 2:  # else it was overwritten meanwhile
                break
        shapes = {}
        for k in range(struct.unpack_from('<Q', frame, 32)[0]):
            name, length, positions, nodes = struct.unpack_from('<4Q', frame, 64 + 32 * k)
            shapes[frame[name:name + length].decode()] = numpy.frombuffer(frame, '<f8', 3 * nodes, positions).reshape(-1, 3)
        return shapes


class Driven(Scene):
    """The scene of a run that `drive` started; closing it ends the run."""

    def __init__(self, *options, cwd=None):
        self._cwd = cwd
        self.folder = tempfile.TemporaryDirectory(prefix='gewebe-')
        at, shapes_at = os.path.join(self.folder.name, 'socket'), os.path.join(self.folder.name, 'shapes')
        with open(os.path.join(self.folder.name, 'said'), 'wb') as said:
            self.process = subprocess.Popen(
                [path_of('ffe-run'), '--serve', '--ack', '--listen', at, '--shapes-in', shapes_at, *options],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=said, cwd=cwd)
        try:
            while not os.path.exists(at):
                if self.process.poll() is not None:
                    raise Error(self._said() or 'ffe-run: ended', self.process.returncode)
                time.sleep(0.01)
            super().__init__(at)
            self._shapes = Shapes(shapes_at)
        except BaseException:
            self._stop()
            raise

    def _said(self):
        with open(os.path.join(self.folder.name, 'said'), encoding='utf-8', errors='replace') as said:
            return said.read().strip()

    def _stop(self):
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait()
        self.folder.cleanup()

    def shapes(self):
        """Positions of all nodes, [n, 3] in mm, by object, of the last answer."""
        return self._shapes.last()

    def picture(self, size: int | str = 400, *options: str) -> bytes:
        """PNG of the objects that `add` has added, as they are in the last answer, by emboss-render with further options.

        Raises Error before the first step, and for an object whose surface a cut has changed while no shapes are emitted.
        """
        parts, triangles, count = [], [], 0
        for name, positions in self.shapes().items():
            if name not in self._surfaces:
                raise Error(f'the surface of {name} is unknown, expected an object that add() has added, and emit shapes before a cut')
            triangles.append(self._surfaces[name] + count)
            parts.append(positions)
            count += len(positions)
        if not parts:
            raise Error('there is no answer to draw, expected a step first')
        file = io.BytesIO()
        write_ply(file, points=numpy.concatenate(parts), triangles=numpy.concatenate(triangles))
        return run(['emboss-render', '--format', 'ply', '--size', str(size), '--to', 'png', *options], input=file.getvalue()).output

    def _repr_png_(self) -> bytes | None:
        """The picture that a notebook shows; None before the first step."""
        return self.picture() if self._shapes.last() and not self._ended else None

    def __exit__(self, kind, *_):
        try:
            self.close()
        except Error:  # what was raised within counts more
            if kind is None:
                raise

    def close(self):
        """Ends the run and completes its files (-o, --record). Raises Error with the message of the run."""
        try:
            self.ask('end')
        except (Error, OSError):
            pass  # what it was tells its status
        self._leave()
        self._shapes.close()
        self.process.wait()
        said = (self._said().splitlines() or ['ffe-run: failed'])[-1]
        at = os.path.join(self.folder.name, 'socket')
        self._stop()
        # That lines were refused has been raised where they were asked.
        if self.process.returncode and not said.startswith(f'ffe-run: {at}, client '):
            raise Error(said, self.process.returncode)


def drive(*options, cwd=None):
    """Starts ffe-run with further options ('-o', 'run.h5') and returns its scene, Driven; paths in lines count from cwd.

        with gewebe.drive() as scene:
            scene.ask('object ball ball.ela', 'force near:0,0,50,5 0 0 1000', 'step 0.1')
            scene.shapes()['ball']
    """
    return Driven(*options, cwd=cwd)

"""Runs programs, alone or in pipes."""
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import tempfile
import threading
import warnings
from importlib import metadata
from pathlib import Path

from .errors import Error
from .ply import read_ply

# What --progress draws: "\rTOOL [####....]  42 %  …\x1b[K", without a bar where the end is unknown, and "\r\x1b[K" where it takes that away.
_BAR = re.compile(r'^([a-z0-9-]+) \[[#.]+\] +(\d+) %')
_ESCAPE = '\x1b[K'


def path_of(program):
    """Path of a program: in the folder GEWEBE_BIN, else in the wheel of this module, else in the PATH."""
    folder = os.environ.get('GEWEBE_BIN')
    if folder:
        found = shutil.which(program, path=folder)
        if found:
            return found
        raise Error(f'{folder}: no program {program}, though GEWEBE_BIN names it')
    try:
        wheel = metadata.distribution('gewebe')
    except metadata.PackageNotFoundError:
        wheel = None
    # A module that is used out of a folder is none of the wheel's, even if there is one too.
    if wheel is not None and Path(wheel.locate_file('gewebe/programs.py')).resolve() == Path(__file__).resolve():
        for file in wheel.files or ():
            if file.name == program and file.parts[0] == '..':
                return str(Path(wheel.locate_file(file)).resolve())
    found = shutil.which(program)
    if found:
        return found
    raise Error(f'no program {program}, neither of the wheel nor in the PATH')


class Outcome:
    """Result of a pipe.

    output is the standard output of the last program, as bytes. stats has the figures of --stats of each program, in order, if
    requested.
    """

    def __init__(self, output, stats):
        self.output = output
        self.stats = stats

    def mesh(self):
        """The output as a mesh, Ply."""
        return read_ply(self.output)


class _Listener(threading.Thread):
    """Reads standard error of one program: forwards progress, keeps the rest."""

    def __init__(self, stream, progress):
        super().__init__(daemon=True)
        self.stream, self.progress = stream, progress
        self.lines, self.failure = [], None
        self.start()

    def run(self):
        pending = ''
        while True:
            piece = self.stream.read1(65536)
            if not piece:
                break
            *done, pending = re.split('[\r\n]', pending + piece.decode(errors='replace'))
            # A bar is whole with its escape at the end, though the next one is not there yet.
            if pending.endswith(_ESCAPE):
                done.append(pending)
                pending = ''
            for line in done:
                self.hear(line)
        self.hear(pending)
        self.stream.close()

    def hear(self, line):
        drawn = line.endswith(_ESCAPE)
        line = line.replace(_ESCAPE, '')
        bar = _BAR.match(line)
        if bar is None:
            if line and not drawn:
                self.lines.append(line)
        elif self.progress is not None and self.failure is None:
            try:
                self.progress(bar[1], int(bar[2]) / 100)
            except BaseException as failure:  # raised in run(), and not lost with this thread
                self.failure = failure


def _words(stage):
    words = shlex.split(stage) if isinstance(stage, str) else [os.fspath(word) for word in stage]
    if not words:
        raise ValueError('a stage without a program')
    return words


def _bytes_of(input):
    if isinstance(input, str):
        return input.encode()
    if hasattr(input, 'to_bytes'):
        return input.to_bytes()
    return None if input is None else bytes(input)


def _feed(stream, data):
    for work in (lambda: stream.write(data), stream.close):
        try:
            work()
        except BrokenPipeError:  # who does not read to the end says itself why
            pass


def _judge(names, processes, listeners):
    """Raises the first failure in the order of the pipe; forwards warnings."""
    for listener in listeners:
        if listener.failure is not None:
            raise listener.failure
    complaints = []
    for name, process, listener in zip(names, processes, listeners):
        others = []
        for line in listener.lines:
            if line.startswith(f'{name}: warning: '):
                warnings.warn(line, stacklevel=3)
            else:
                others.append(line)
        # Who is cut off by the next one, that no longer reads, did nothing wrong.
        if process.returncode not in (0, -signal.SIGPIPE):
            said = others[-1] if others else f'{name}: ended with status {process.returncode}'
            complaints.append((process.returncode, said))
    if complaints:
        # Behind a program that failed the next one finds an empty pipe.
        status, said = complaints[0]
        raise Error(said, status)


def run(*stages, input=None, progress=None, stats=False, cwd=None):
    """Runs programs in a pipe and returns an Outcome.

    A stage is a program with its arguments: a string that is split as by a shell ('mc-opt --resample 2'; no pipes, no globs)
    or a list of words, which may be paths. input of the first program is text, bytes or a Ply. progress is called with the
    name of a program and its progress, 0 to 1, from one thread per program. Warnings are Python's. Raises Error with the
    message of the first program that failed.
    """
    if not stages:
        raise ValueError('no program to run')
    lines = [_words(stage) for stage in stages]
    names = [words[0] for words in lines]
    data = _bytes_of(input)
    with tempfile.TemporaryDirectory(prefix='gewebe-') as folder:
        processes, listeners, before = [], [], None
        try:
            for k, words in enumerate(lines):
                command = [path_of(words[0]), *words[1:]]
                if progress is not None:
                    command += ['--progress', 'always']
                if stats:
                    command.append(f'--stats={folder}/{k}')
                first = before is None
                process = subprocess.Popen(
                    command, stdin=before if not first else subprocess.DEVNULL if data is None else subprocess.PIPE,
                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=cwd)
                if not first:
                    before.close()  # is the next one's alone, so that its end is seen
                before = process.stdout
                processes.append(process)
                listeners.append(_Listener(process.stderr, progress))
            if data is not None:
                threading.Thread(target=_feed, args=(processes[0].stdin, data), daemon=True).start()
            output = before.read()
            before.close()
            for process in processes:
                process.wait()
        except BaseException:
            for process in processes:
                process.kill()
                process.wait()
            raise
        finally:
            for listener in listeners:
                listener.join()
        _judge(names, processes, listeners)
        told = [json.loads((Path(folder) / str(k)).read_text()) for k in range(len(lines))] if stats else []
    return Outcome(output, told)

"""Answers to steps, gewebe_serve(5), as arrays."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Iterator, Sequence

import numpy

from .errors import Error


@dataclass
class Forces:
    """Forces at displaced and touched nodes of an object: nodes [n], vectors [n, 3] in 1e-6 N."""

    nodes: numpy.ndarray
    vectors: numpy.ndarray

    @property
    def total(self) -> numpy.ndarray:
        """Their sum, [3] in 1e-6 N."""
        return self.vectors.sum(axis=0)


@dataclass
class Stress:
    """Stress at nodes of a solid: nodes [n], tensors [n, 6] xx xy xz yy yz zz and von_mises [n] in Pa."""

    nodes: numpy.ndarray
    tensors: numpy.ndarray
    von_mises: numpy.ndarray


@dataclass
class Estimate:
    """Errors that the mesh of a solid causes: relative, force in 1e-6 N, displacement in mm, stress in Pa."""

    relative: float
    force: float
    displacement: float
    stress: float


@dataclass
class Instrument:
    """position [3] and hand [3] (of a coupled instrument, else None) in mm, force [3] in 1e-6 N, torque [3] in 1e-9 N m."""

    position: numpy.ndarray
    force: numpy.ndarray
    torque: numpy.ndarray
    hand: numpy.ndarray | None = None


@dataclass
class Answer:
    """Answer to a step: its number, the time in s, and by name what the scene emits; empty where it emits nothing.

    shapes are positions [n, 3] in mm, triangles those of surfaces that a cut has changed, events the records of jumps and
    cuts as words.
    """

    step: int
    time: float
    forces: dict[str, Forces] = field(default_factory=dict)
    shapes: dict[str, numpy.ndarray] = field(default_factory=dict)
    triangles: dict[str, numpy.ndarray] = field(default_factory=dict)
    stress: dict[str, Stress] = field(default_factory=dict)
    estimates: dict[str, Estimate | None] = field(default_factory=dict)
    instruments: dict[str, Instrument] = field(default_factory=dict)
    events: list[list[str]] = field(default_factory=list)


_EVENTS = ('jump', 'cut', 'part', 'loose', 'restored')


def _rows(records: Iterator[Sequence[str]], count: str, width: int, dtype: type = float) -> numpy.ndarray:
    rows = numpy.array([next(records) for _ in range(int(count))], dtype)
    return rows.reshape(-1, width)


def _instrument(words: Sequence[str]) -> Instrument:
    numbers = numpy.array(words, float)
    return Instrument(numbers[:3], numbers[3:6], numbers[6:9], numbers[9:12] if len(numbers) > 9 else None)


def _take(answer: Answer, words: Sequence[str], records: Iterator[Sequence[str]]) -> None:
    kind, rest = words[0], words[1:]
    if kind in _EVENTS:
        answer.events.append(list(words))
    elif kind == 'forces':
        rows = _rows(records, rest[1], 4)
        answer.forces[rest[0]] = Forces(rows[:, 0].astype(int), rows[:, 1:])
    elif kind == 'shapes':
        answer.shapes[rest[0]] = _rows(records, rest[1], 3)
    elif kind == 'triangles':
        answer.triangles[rest[0]] = _rows(records, rest[1], 3, int)
    elif kind == 'stress':
        rows = _rows(records, rest[1], 8)
        answer.stress[rest[0]] = Stress(rows[:, 0].astype(int), rows[:, 1:7], rows[:, 7])
    elif kind == 'estimate':
        answer.estimates[rest[0]] = None if rest[1] == 'none' else Estimate(*map(float, rest[1:5]))
    elif kind == 'instruments':
        for _ in range(int(rest[0])):
            name, *numbers = next(records)
            answer.instruments[name] = _instrument(numbers)
    else:
        raise Error(f'an answer with the record {kind}, which this version does not read')


def read_answers(lines: Sequence[Sequence[str]]) -> list[Answer]:
    """The answers to steps among records, as Scene.ask returns them. Raises Error for records of no step."""
    answers: list[Answer] = []
    records = iter(lines)
    for words in records:
        if words[0] != 'step':
            raise Error(f'{" ".join(words)}: no answer to a step')
        answer = Answer(int(words[1]), float(words[2]))
        for words in records:
            if words[0] == 'done':
                break
            _take(answer, words, records)
        answers.append(answer)
    return answers

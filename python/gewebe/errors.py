"""Errors of programs, scenes and files."""


class Error(Exception):
    """Error of a program, a scene or a file: one line. status is the exit status of a program, else None."""

    def __init__(self, text, status=None):
        super().__init__(text)
        self.status = status

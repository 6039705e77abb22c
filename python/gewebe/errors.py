"""What goes wrong."""


class Error(Exception):
    """What a program, a scene or a file says is wrong: one line. status is that of the program, else None."""

    def __init__(self, text, status=None):
        super().__init__(text)
        self.status = status

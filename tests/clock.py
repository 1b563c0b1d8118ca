"""A clock that advances when it is read, so that no test depends on real time."""

from iccm import deadline


class Clock:
    """Advances by a step at every reading, and counts the readings."""

    def __init__(self, monkeypatch):
        self.now, self.checks, self.step = 0.0, 0, 0.0
        monkeypatch.setattr(deadline.time, "monotonic", self)

    def __call__(self):
        self.checks, self.now = self.checks + 1, self.now + self.step
        return self.now

"""A clock that moves when it is asked, so that no test depends on a real one."""

from iccm import deadline


class Clock:
    """Moves on by a step whenever it is asked, and counts how often that is."""

    def __init__(self, monkeypatch):
        self.now, self.asked, self.step = 0.0, 0, 0.0
        monkeypatch.setattr(deadline.time, "monotonic", self)

    def __call__(self):
        self.asked, self.now = self.asked + 1, self.now + self.step
        return self.now

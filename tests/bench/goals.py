"""Goals that benches hold figures against: a line each, which `python -m tests.bench` repeats at its end."""

MARK = "GOAL"


def goal(name: str, found: float, most: float, unit: str = "") -> None:
    """Print whether a figure is at most what was aimed at."""
    met = "met    " if found <= most else "NOT MET"
    print(f"{MARK} {met} {name}: {found:.3g} of at most {most:.3g}{unit and ' ' + unit}", flush=True)

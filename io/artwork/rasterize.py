"""Program that runs resvg on a document from stdin, and writes the PNG to stdout.

Documents can require unlimited time (nested patterns, filters with a radius of a million), and a call into resvg cannot
be interrupted. A process can be: by the caller, and if that has died, by its own alarm.
"""

import signal
import sys


def main() -> None:
    """Render stdin within the seconds of the first argument; with the argument `fonts`, system fonts are used."""
    if hasattr(signal, "alarm"):  # on POSIX
        signal.alarm(int(sys.argv[1]))
    import resvg_py

    text = sys.stdin.buffer.read().decode()
    try:
        png = resvg_py.svg_to_bytes(svg_string=text, skip_system_fonts="fonts" not in sys.argv[2:])
    except ValueError as error:
        sys.exit(str(error))
    sys.stdout.buffer.write(bytes(png))


if __name__ == "__main__":
    main()

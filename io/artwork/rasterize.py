"""Run resvg on a document from stdin, and write the PNG to stdout: a separate program.

Nothing bounds what a document asks of resvg (patterns in patterns, filters with a radius of a million), and a call into
it cannot be stopped. A process can: by who started it, and where that has died, by the system.
"""

import signal
import sys


def main() -> None:
    """Render stdin within some seconds; with the argument `fonts`, letters may be those of the system's fonts."""
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

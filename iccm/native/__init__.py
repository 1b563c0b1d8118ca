"""The compiled core: C++ kernels of the folder `core/`, called through a plain C interface.

library   finds and loads the shared library that fits the processor
binding   declares functions and structs of it for Python, and functions that it calls
"""

from .binding import Record, array_at, callback, function, record

__all__ = ["Record", "array_at", "callback", "function", "record"]

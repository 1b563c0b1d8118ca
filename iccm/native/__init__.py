"""The compiled core: C++ kernels in the folder `core/`, called through a plain C interface.

library   finds and loads the shared library for the processor
binding   declares its functions, structs and callbacks for Python
"""

from .binding import Record, array_at, callback, function, record

__all__ = ["Record", "array_at", "callback", "function", "record"]

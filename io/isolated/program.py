"""Program that reads a file with a library in native code, and writes numbers and arrays to stdout.

A damaged file can crash these libraries, keep them busy for ever, or make them allocate all memory, and a call cannot
be interrupted. A process can be limited. It imports nothing of iccm, so that it starts in a few hundredths of a second
more than its library needs.

    python program.py MODULE_FILE FUNCTION CPU_SECONDS MEMORY_BYTES ARGUMENTS_AS_JSON

The module has the function that reads the file. It imports the library inside of the function, and of iccm only
`Damaged`, which it raises where the file is wrong.

stdout is a line of JSON, followed by the arrays that it describes. Its key `values` has the result, with arrays as
their numbers; or `error` says in a sentence what is wrong with the file.
"""

import json
import os
import runpy
import sys
from typing import Any

import numpy as np


class Damaged(Exception):
    """The file is wrong; the message is a sentence without its name."""


def limit(cpu_seconds: int, memory_bytes: int) -> None:
    """Limit the processor time and the address space of this process, where the system can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for kind, most in ((resource.RLIMIT_CPU, cpu_seconds), (resource.RLIMIT_AS, memory_bytes)):
        allowed = resource.getrlimit(kind)[1]
        least = most if allowed == resource.RLIM_INFINITY else min(most, allowed)
        try:
            resource.setrlimit(kind, (least, allowed))
        except (OSError, ValueError):  # macOS does not limit the address space
            continue


def pack(value: Any, arrays: list[Any]) -> Any:
    """Return a value as JSON, with arrays appended to a list and replaced by {"array": number}."""
    if isinstance(value, np.ndarray):
        arrays.append(np.ascontiguousarray(value))
        return {"array": len(arrays) - 1}
    if isinstance(value, dict):
        return {key: pack(item, arrays) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [pack(item, arrays) for item in value]
    return value


def main() -> None:
    """Read the file, and write the result to what stdout was when the program started."""
    module, function, seconds, memory, arguments = sys.argv[1:]
    # so that the module imports `Damaged` from here, without the package
    sys.modules["iccm.io.isolated.program"] = sys.modules["__main__"]
    with os.fdopen(os.dup(1), "wb") as out, open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)  # libraries may print
        os.dup2(nowhere.fileno(), 2)
        arrays: list[Any] = []
        try:
            limit(int(seconds), int(memory))
            read = runpy.run_path(module)[function]
            message: dict[str, Any] = {"values": pack(read(**json.loads(arguments)), arrays)}
        except Damaged as error:
            message = {"error": str(error)}
        except ImportError as error:
            message = {"missing": str(error)}
        except MemoryError:
            message = {"error": "needs more memory than files of its size may take"}
        except Exception as error:  # whatever exception a parser raises, the file is at fault
            name = json.loads(arguments)["path"]
            reason = " ".join(str(error).replace(name, os.path.basename(name)).split())[:120]
            message = {"error": f"cannot be read ({reason or type(error).__name__})"}
        message["arrays"] = [{"dtype": array.dtype.str, "shape": array.shape} for array in arrays]
        out.write(json.dumps(message).encode() + b"\n")
        for array in arrays:
            # as bytes, because not all types have buffers
            out.write(array.reshape(-1).view(np.uint8).data if array.size else b"")
    os._exit(0)  # without what libraries do at the end, which may fail after all is written


if __name__ == "__main__":
    main()

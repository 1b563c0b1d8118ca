"""Single-line bugs, and whether the tests of their folder catch them: `python -m tests.mutants --help`.

mutant    a bug: file, old text, new text, tests, effect on users
library   bugs in iccm/
files     bugs in io/
commands  bugs in cli/
core      bugs in the compiled core
run       puts them, one by one, into a copy of the repository, and runs their tests there
"""

from .commands import COMMANDS
from .core import CORE
from .files import FILES
from .library import LIBRARY
from .mutant import Mutant

MUTANTS: list[Mutant] = [*LIBRARY, *FILES, *COMMANDS, *CORE]

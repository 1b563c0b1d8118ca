"""Single-line bugs, and whether the tests of their folder detect them: `python -m tests.mutants --help`.

mutant    a bug: file, old text, new text, tests, effect on users
library   bugs in iccm/
files     bugs in io/
page      bugs in the page of `iccm edit`
commands  bugs in cli/
core      bugs in the compiled core
run       puts them, one by one, into a copy of the repository, and runs their tests there
"""

from .commands import COMMANDS
from .core import CORE
from .files import FILES
from .library import LIBRARY
from .mutant import Mutant
from .page import PAGE

MUTANTS: list[Mutant] = [*LIBRARY, *FILES, *PAGE, *COMMANDS, *CORE]

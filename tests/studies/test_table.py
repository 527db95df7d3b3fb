"""Tables are declared in words: whoever reads or draws one pays for no library that computes it."""

import subprocess
import sys

ASK = """
import sys
from palpate.report.declared import table as find
assert find("scaling").columns and find("claims").columns
print(*sorted(name for name in sys.modules if name.split(".")[0] in ("numpy", "scipy", "pandas", "numba", "skfem")))
"""


def test_looking_up_a_table_imports_no_library():
    done = subprocess.run([sys.executable, "-c", ASK], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []

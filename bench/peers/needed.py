# SPDX-License-Identifier: Apache-2.0
"""Modules that a script of this folder needs, and that a machine may lack."""
import importlib
import sys


def modules(*names):
    """They, in this order; without one of them it says so, and the script ends as skipped (77)."""
    try:
        return [importlib.import_module(name) for name in names]
    except ImportError as e:
        print("SKIP: this python3 has not all of %s (%s)" % (", ".join(names), e), file=sys.stderr)
        sys.exit(77)

# SPDX-License-Identifier: Apache-2.0
"""What the tests of this folder print: a line of TAP for each check, and the plan at the end."""
import sys

count = failed = 0


def ok(good, what):
    global count, failed
    count += 1
    failed += not good
    print("%sok %d - %s" % ("" if good else "not ", count, what), flush=True)


def done():
    print("1..%d" % count)
    sys.exit(failed > 0)

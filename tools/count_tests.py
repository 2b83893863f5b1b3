# SPDX-License-Identifier: Apache-2.0
"""Count what a JUnit log of meson says: prints "passed failed". A TAP program counts by its
checks, any other by itself; a program that crashed or stopped early counts as one failure."""
import sys
import xml.etree.ElementTree as tree

passed = failed = 0
for suite in tree.parse(sys.argv[1]).getroot().iter("testsuite"):
    for case in suite.iter("testcase"):
        if case.find("skipped") is not None:
            continue
        if case.find("failure") is not None or case.find("error") is not None:
            failed += 1
        else:
            passed += 1
    # A suite may fail as a whole: no plan, a crash after good checks, a timeout.
    whole = int(suite.get("errors") or 0) + int(suite.get("failures") or 0)
    inside = sum(1 for case in suite.iter("testcase")
                 if case.find("failure") is not None or case.find("error") is not None)
    if whole > inside:
        failed += whole - inside
print(passed, failed)

# SPDX-License-Identifier: Apache-2.0
"""Count what meson's testlog.json says: prints "passed failed" on standard output, and each
failure on standard error. A TAP program counts by its checks, any other by itself; a program
that crashed, timed out or stopped early counts as one failure more."""
import json
import re
import sys


def count(test):
    """(passed, failed, what to say about it) of one program."""
    out = test.get("stdout", "")
    checks = re.findall(r"^(not )?ok\b(.*# SKIP)?", out, re.M)
    good = sum(1 for bad, skipped in checks if not bad and not skipped)
    bad = sum(1 for failed, _ in checks if failed)
    if test["result"] in ("OK", "EXPECTEDFAIL"):
        return (good if checks else 1), bad, []
    if test["result"] == "SKIP":
        return 0, 0, []
    said = re.findall(r"^not ok.*(?:\n# .*)*", out, re.M)
    if not bad:
        said = [f"{test['result']}, exit status {test['returncode']}",
                *out.splitlines()[-3:], *test.get("stderr", "").splitlines()[:40]]
    return good, max(bad, 1), said


passed = failed = 0
with open(sys.argv[1], encoding="utf-8") as log:
    for line in log:
        test = json.loads(line)
        good, bad, said = count(test)
        passed += good
        failed += bad
        if bad:
            print(f"-- {test['name']}", *said, sep="\n   ", file=sys.stderr)
print(passed, failed)

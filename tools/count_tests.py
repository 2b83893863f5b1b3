# SPDX-License-Identifier: Apache-2.0
"""Count what meson's testlog.json says: prints "passed failed". A TAP program counts by its
checks, any other by itself; a program that crashed, timed out or stopped early counts as one
failure more."""
import json
import re
import sys

passed = failed = 0
with open(sys.argv[1], encoding="utf-8") as log:
    for line in log:
        test = json.loads(line)
        checks = re.findall(r"^(not )?ok\b(.*# SKIP)?", test.get("stdout", ""), re.M)
        good = sum(1 for bad, skipped in checks if not bad and not skipped)
        bad = sum(1 for bad, _ in checks if bad)
        if test["result"] == "OK":
            good = good if checks else 1
        elif test["result"] != "SKIP" and not bad:
            bad = 1
        passed += good
        failed += bad
print(passed, failed)

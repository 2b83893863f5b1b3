#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The tests that take longest, from a log of meson test: seconds, name.

    tools/slow_tests.py [LOG, default build-test/meson-logs/testlog.json] [N, default 10]"""
import json
import sys


def main():
    log = sys.argv[1] if len(sys.argv) > 1 else "build-test/meson-logs/testlog.json"
    n = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    with open(log, encoding="utf-8") as lines:
        tests = [json.loads(line) for line in lines]
    total = sum(t["duration"] for t in tests)
    print(f"{len(tests)} programs, {total:.0f} s one after the other; the slowest:")
    for t in sorted(tests, key=lambda t: -t["duration"])[:n]:
        print(f"{t['duration']:7.1f} s  {t['name']}")


if __name__ == "__main__":
    main()

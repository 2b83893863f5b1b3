# SPDX-License-Identifier: Apache-2.0
# The gradient agrees with its transpose and with differences: exit 0, one line a check.
importon bend check "$ROOT/scenes/bend/focus.xml" -D count=60 -D cells=8 >table || exit 9
grep -c ' ok$' table
importon bend check "$ROOT/scenes/bend/plume.xml" -D count=9 --json | python3 -c '
import json, sys
a = json.load(sys.stdin)
assert a["ok"] and {r["method"] for r in a["rows"]} >= {"dot", "transpose", "difference", "step"}'

# SPDX-License-Identifier: Apache-2.0
importon check --json --spp 64 --paths 50 "$ROOT/scenes/furnace.xml" >answer.json 2>/dev/null || exit 9
python3 - <<'END'
import json
a = json.load(open("answer.json"))
assert a["failed"] == 0 and len(a["rows"]) > 2
assert {"frozen", "fresh", "dot"} <= {r["method"] for r in a["rows"]}
END

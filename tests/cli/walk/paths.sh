# SPDX-License-Identifier: Apache-2.0
# One JSON object a line.
importon render "$ROOT/scenes/cornell.xml" -D res=16 --paths walks.jsonl --count 20 || exit 9
wc -l <walks.jsonl
while read -r line; do python3 -m json.tool <<<"$line" >/dev/null || exit 9; done < <(head -n 3 walks.jsonl)

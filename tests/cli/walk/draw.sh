# SPDX-License-Identifier: Apache-2.0
# Walks are drawn: as many segments as the walks have vertices, after the twelve of the box.
scene=(-m mono "$ROOT/scenes/stam.xml")
importon render "${scene[@]}" --paths walks.jsonl --count 12 -q || exit 9
importon render "${scene[@]}" --points independent --pixel 16,16 --sample 39 --json >walk.jsonl || exit 9
for walks in walks walk; do
    python3 "$ROOT/docs/draw_paths.py" $walks.jsonl $walks.svg --sphere 0,0,0,.5 || exit 9
    python3 - $walks <<'PY' || exit 9
import json, sys, xml.etree.ElementTree as tree
name = sys.argv[1]
wanted = 12 + sum(len(json.loads(t)['vertices']) for t in open(name + '.jsonl'))
lines = tree.parse(name + '.svg').findall('{http://www.w3.org/2000/svg}line')
assert len(lines) == wanted > 14, (len(lines), wanted)
PY
done

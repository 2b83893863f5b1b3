# SPDX-License-Identifier: Apache-2.0
# A target whose highlights are cut off is announced, unless they are masked; so is a loss
# that asks for fewer samples than it takes.
box=$ROOT/scenes/cornell.xml
importon render "$box" -D res=16 --spp 64 -q -o lamp.png || exit 9
importon gradient "$box" -D res=16 -T lamp.png --spp 1 >/dev/null
python3 - <<'PY'
import struct
rows = [[0 if 5 <= x <= 10 and 11 <= y else 1 for x in range(16)] for y in range(16)]
with open('mask.pfm', 'wb') as f:
    f.write(b'Pf\n16 16\n-1\n')
    for row in rows:
        f.write(struct.pack('<16f', *row))
PY
importon gradient "$box" -D res=16 -T lamp.png --mask mask.pfm --spp 2 >/dev/null

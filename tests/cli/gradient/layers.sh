# SPDX-License-Identifier: Apache-2.0
# The picture and its derivatives in one file, as layers in the names that viewers group;
# a report has each of them once.
names() {
    python3 - "$1" <<'PY'
import struct, sys
data = open(sys.argv[1], "rb").read()
at = data.index(b"channels\0chlist\0") + 16
end = at + 4 + struct.unpack_from("<i", data, at)[0]
at += 4
while data[at]:
    stop = data.index(b"\0", at)
    print(data[at:stop].decode())
    at = stop + 17
PY
}
mkdir r
importon jacobian "$ROOT/scenes/cornell.xml" -D res=8 --spp 4 -p 'red.*' -p 'light.*' --layers r/all.exr -o r -q >r.txt || exit 9
names r/all.exr
importon report r -q && grep -o '"kind":"[a-z]*","name":"[^"]*"' r/report.html
# With errors of its own: a second run writes the same.
importon jacobian "$ROOT/scenes/cornell.xml" -D res=8 --spp 4 -p 'red.*' -p 'light.*' --separate --layers s.exr -o s -q >s.txt || exit 9
names s.exr | grep -c '^d\.'
importon jacobian "$ROOT/scenes/cornell.xml" -D res=8 --spp 4 -p 'red.*' --layers no/all.exr -o t -q 2>&1 | sed 's/:.*//'
importon jacobian "$ROOT/scenes/cornell.xml" -D res=8 --spp 4 -p 'red.*' --layers all.txt -o t -q

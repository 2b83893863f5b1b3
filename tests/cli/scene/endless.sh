# SPDX-License-Identifier: Apache-2.0
# Small files that become large ones, files of holes, and pipes that say nothing or never end are
# refused with their numbers, in little memory and time.
cat >mesh.xml <<'X'
<scene version="3.0.0"><integrator type="path"/><default name="type" value="serialized"/><sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
<shape type="$type"><string name="filename" value="$file"/></shape><emitter type="constant"/></scene>
X
cat >image.xml <<'X'
<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="$file"/></texture></bsdf></shape><emitter type="constant"/></scene>
X
python3 - <<'P'
import struct, zlib
def packed(head, n):
    c = zlib.compressobj(9)
    return c.compress(head) + b"".join(c.compress(bytes(min(1 << 20, n - k))) for k in range(0, n, 1 << 20)) + c.flush()
def serialized(name, v, t):
    body = struct.pack("<HH", 0x041c, 4) + packed(struct.pack("<IBQQ", 0x1000, 0, v, t), 12 * (v + t))
    open(name, "wb").write(body + struct.pack("<QI", 0, 1))
serialized("bomb.serialized", 1 << 24, 1 << 24)
serialized("small.serialized", 1 << 10, 1 << 10)
def png(name, w, h):
    chunk = lambda kind, b: struct.pack(">I", len(b)) + kind + b + struct.pack(">I", zlib.crc32(kind + b))
    open(name, "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", w, h, 8, 2, 0, 0, 0)) +
        chunk(b"IDAT", packed(b"", h * (1 + 3 * w))) + chunk(b"IEND", b""))
png("bomb.png", 10000, 10000)
png("small.png", 1000, 1000)
# EXR, one channel of half, ZIPS: a table of offsets and no more has to be there for its size.
def exr(name, w, h):
    attribute = lambda n, t, b: n + b"\0" + t + b"\0" + struct.pack("<I", len(b)) + b
    box = struct.pack("<4i", 0, 0, w - 1, h - 1)
    head = struct.pack("<II", 20000630, 2) + attribute(b"channels", b"chlist", b"Y\0" + struct.pack("<iIii", 1, 0, 1, 1) + b"\0")
    head += attribute(b"compression", b"compression", b"\2") + attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box)
    head += attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    head += attribute(b"screenWindowCenter", b"v2f", bytes(8)) + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0"
    line, out, at = zlib.compress(bytes(2 * w), 9), [], len(head) + 8 * h
    for y in range(h):
        out.append(struct.pack("<ii", y, len(line)) + line)
    offsets, place = [], at
    for b in out: offsets.append(place); place += len(b)
    open(name, "wb").write(head + struct.pack("<%dQ" % h, *offsets) + b"".join(out))
exr("bomb.exr", 20000, 20000)
exr("small.exr", 1000, 10)
P
truncate -s 1T holes.ply
truncate -s 2G holes.serialized holes.exr
truncate -s 2G holes.xml
mkfifo silent nobody
# try WORD...
try() { echo "+ $*"; importon render "$@" --spp 1 -q -o o.exr --no-preview 2>&1; }
sleep 600 >silent &
hold=$!
(importon info silent >said.silent 2>&1; echo "exit $?" >>said.silent) &
silent=$!
(importon render mesh.xml -D type=obj -D file=nobody -q >said.nobody 2>&1; echo "exit $?" >>said.nobody) &
nobody=$!
for name in bomb small; do
    try mesh.xml -D file=$name.serialized
    for kind in png exr; do try image.xml -D file=$name.$kind; done
done
try mesh.xml -D type=ply -D file=holes.ply
try mesh.xml -D file=holes.serialized
try image.xml -D file=holes.exr
try holes.xml
echo "+ a pipe that never ends"
yes | importon info /dev/stdin 2>&1
yes | importon render image.xml -D file=/dev/stdin -q 2>&1
echo "+ pipes that end"
importon info <(true) 2>&1
importon info <(sleep 1; cat "$ROOT/scenes/furnace.xml") | head -1
wait $nobody $silent
kill $hold
cat said.nobody said.silent

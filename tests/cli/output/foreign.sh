# SPDX-License-Identifier: Apache-2.0
# No command replaces a file that importon did not write: every output of every command is tried on
# thirty kinds of foreign files. Alone, each command is run twice: it replaces what it wrote itself
# (a checkpoint is gone on from with --resume).
# Not under sanitizers: six hundred starts of the program; overwrite.sh goes through the same code there.
cp "$ROOT/scenes/furnace.xml" own.xml
cp "$ROOT/scenes/elements/a.xml" a.xml
cp "$ROOT/scenes/bend/plume.xml" plume.xml
importon render own.xml -D res=8 --spp 4 -q -o target.exr --no-preview --no-manifest || exit 9
importon render own.xml -D res=8 --spp 4 -q --part 1/2 -o a.part || exit 9
importon record own.xml -D res=8 --spp 2 -q -o own.walks || exit 9
mkdir foreign results
cp target.exr results/picture.exr
python3 - <<'PY'
import struct, zlib
def put(name, data): open("foreign/" + name, "wb").write(data if isinstance(data, bytes) else data.encode())
def chunk(kind, data): return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
def png(*texts):
    head = struct.pack(">IIBBBBB", 1, 1, 8, 0, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + b"".join(chunk(b"tEXt", t) for t in texts) +
            chunk(b"IDAT", zlib.compress(b"\0\x80")) + chunk(b"IEND", b""))
put("env", "PORT=8080\nSECRET=hunter2\n")
put("settings", "lamp.radiance.value=3\n")
put("quoted", "# settings of importon\nlamp=3\n")
put("signed", "mean 3 +- 0.1\n")
put("method", "method of least squares\n")
put("object", "object of the letter\n")
put("mesh_list", "a box (12 triangles)\n")
put("letter", "a letter about importon\n")
put("log", "check the oven\n")
put("csv", "x,y\n1,2\n")
put("json", '{"name":"importon","version":1}\n')
put("json_lines", '{"x":[1,2]}\n')
put("html", "<!doctype html><title>importon and I</title>\n")
put("svg", '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 440"></svg>\n')
put("svg_comment", '<svg viewBox="0 0 720 440"><!-- importon --></svg>\n')
put("ply", "ply\nformat ascii 1.0\ncomment importon looks at this\nend_header\n")
put("hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x01\x01\x01\x01")
put("hdr_other", "#?RGBE\n# importon\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x01\x01\x01\x01")
put("pfm", b"Pf\n1 1\n-1.0\n" + struct.pack("<f", 1))
put("pfm_colour", b"PF\n1 1\n-1.000000\n" + struct.pack("<3f", 1, 2, 3))
put("npy", b"\x93NUMPY\x01\0\x76\0" + b"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 1), }".ljust(117) + b"\n" + struct.pack("<f", 1))
put("npy_text", b"\x93NUMPY\x01\0\x76\0" + b"{'descr': '|S16', 'fortran_order': False, 'shape': (1,), }".ljust(117) + b"\nimporton \t\t\t\t\n")
put("vol", b"VOL\3" + struct.pack("<5I6f", 1, 1, 1, 1, 1, 0, 0, 0, 1, 1, 1) + struct.pack("<f", 1))
put("png", png())
put("png_comment", png(b"Comment\0importon 0.1.0 made this"))
put("png_software", png(b"Software\0looks like importon 0.1.0"))
put("exr", b"\x76\x2f\x31\x01\x02\0\0\0comments\0string\0\x12\0\0\0importon.version 0")
put("profile", "importon profiles\n")
put("zip", b"PK\3\4" + b"importon" * 9)
put("elf", b"\x7fELF" + bytes(60))
put("pdf", "%PDF-1.4 importon\n")
PY
ls foreign | wc -l
# every OUTPUT... -- COMMAND...: the command, with each foreign file where it would write.
every() {
    local outputs=() kind output own lost=0 ran=0
    while [[ $1 != -- ]]; do outputs+=("$1"); shift; done
    shift
    rm -rf out
    mkdir out
    importon "$@" -q >log 2>&1 </dev/null
    own=$?
    importon "$@" -q >log 2>&1 </dev/null
    own+=", then $?"
    for output in "${outputs[@]}"; do
        for kind in foreign/*; do
            rm -rf out
            mkdir -p "$(dirname "out/$output")"
            cp "$kind" "out/$output"
            importon "$@" -q >log 2>&1 </dev/null && ran=$((ran + 1))
            cmp -s "$kind" "out/$output" || { lost=$((lost + 1)); echo "lost: $kind as $output: $*"; }
        done
    done
    echo "$1 ${outputs[*]}: alone $own; lost $lost, went on $ran"
}
small=(own.xml -D res=4 --spp 1)
every a.txt -- info own.xml -o out/a.txt
every a.txt -- info own.xml --dump -o out/a.txt
every a.txt -- gradient "${small[@]}" -o out/a.txt
every a.txt -- gradient "${small[@]}" --json -o out/a.txt
every a.txt -- check "${small[@]}" --paths 10 -o out/a.txt
every a.txt -- selftest material own.xml --samples 2000 --directions 1 -o out/a.txt
every a.txt -- compare target.exr target.exr -o out/a.txt
every a.txt -- bench "${small[@]}" --repeat 1 -o out/a.txt
every a.txt -- render "${small[@]}" --pixel 1,1 -o out/a.txt
every a.txt -- render "${small[@]}" --paths out/a.txt --count 1
every a.exr a.png -- render "${small[@]}" -o out/a.exr
every a.pfm -- render "${small[@]}" --no-preview -o out/a.pfm
every a.hdr -- render "${small[@]}" --no-preview -o out/a.hdr
every a.npy -- render "${small[@]}" --no-preview -o out/a.npy
every m -- render "${small[@]}" --no-preview -o out/a.exr --manifest out/m
every a.part -- render own.xml -D res=4 --spp 2 --part 1/2 -o out/a.part
every a.part -- merge a.part -o out/a.part
every a.walks -- record "${small[@]}" -o out/a.walks
every a.exr -- what-if own.walks -o out/a.exr
every a.html -- report results -o out/a.html
every a.exr -- envmap target.exr -o out/a.exr
every state -- fit own.xml -D res=8 -T target.exr --spp 2 -n 1 --no-intervals -p 'ball.*' --checkpoint out/state
every recovered.txt loss.csv loss.svg parameters.json recovered.exr recovered.png before.exr target.exr -- \
    fit own.xml -D res=8 -T target.exr --spp 2 -n 1 --no-intervals -p 'ball.*' -o out
every picture.exr controls.csv ball.reflectance.value.exr -- jacobian "${small[@]}" -p 'ball.*' -o out
every a.ply a.json -- elements a.xml --no-image --stop 50 --export out/a.ply --export out/a.json
every a.sol -- elements a.xml --no-image --stop 50 --save out/a.sol
every a.txt -- bend trace plume.xml -o out/a.txt

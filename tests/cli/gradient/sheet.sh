# SPDX-License-Identifier: Apache-2.0
# A contact sheet: eight pictures of 8 x 8, magnified 16 times, in two rows of four.
importon jacobian -m mono "$ROOT/scenes/stam.xml" -D res=8 --spp 4 -q -o J --sheet sheet.png >/dev/null ||
    exit 9
importon render -m mono "$ROOT/scenes/stam.xml" -D res=8 --spp 16 -q --se -o t.exr || exit 9
importon fit -m mono "$ROOT/scenes/stam.xml" -D res=8 --spp 4 -q -n 1 -p 'walls.*' --target t.exr \
    -o fit --sheet fit.png >/dev/null || exit 9
python3 - <<'END'
import struct
for name in ("sheet.png", "fit.png"):
    print(name, *struct.unpack(">II", open(name, "rb").read(24)[16:]))
END
importon fit -m mono "$ROOT/scenes/stam.xml" --target t.exr --sheet fit.png

# SPDX-License-Identifier: Apache-2.0
# The README's scene and commands work as printed.
sed -n '/^```xml/,/^```/p' "$ROOT/README.md" | grep -v '^```' >ball.xml
cp ball.xml photo.xml
importon render photo.xml --spp 4 -q --no-preview -o photo.exr || exit 9
sed -n 's/^    \(importon [^#]*\).*/\1/p' "$ROOT/README.md" >commands
while read -r line; do
    [[ $line == *scenes/* ]] && continue
    eval "$line" >/dev/null 2>log || { echo "+ $line"; cat log; exit 9; }
done <commands

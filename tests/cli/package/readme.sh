# SPDX-License-Identifier: Apache-2.0
# The README's scene and commands work as printed.
sed -n '/^```xml/,/^```/p' "$ROOT/README.md" | grep -v '^```' >ball.xml
cp ball.xml photo.xml
importon render photo.xml --spp 4 -q --no-preview -o photo.exr || exit 9
sed -n 's/^    \(importon [^#]*\).*/\1/p' "$ROOT/README.md" >commands
ln -s "$ROOT/scenes" scenes || exit 9
while read -r line; do
    eval "$line" >/dev/null 2>log || { echo "+ $line"; cat log; exit 9; }
done <commands
# The C in the README and in libimporton.3 compiles.
snippet() {
    printf '#include <importon/importon.h>\n#include <stdio.h>\nint main(void)\n{\n'
    printf 'struct imp_target target = IMP_TARGET_INIT; (void)target;\n'
    grep -v '^#include'
    printf 'return 0;\n}\n'
}
sed -n '/^```c/,/^```/p' "$ROOT/README.md" | grep -v '^```' | snippet >readme.c
sed -n '/^\.Ss A picture/,/^\.Ed/p' "$ROOT/man/libimporton.3" | grep -v '^\.' | snippet >manual.c
for file in readme manual; do
    cc -std=c11 -Wall -Wno-unused-variable -Wno-unused-result -Wno-unused-but-set-variable \
        -Werror -I"$ROOT/include" -fsyntax-only $file.c || exit 9
done

# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: rendering, gradients and fits are run there by other transcripts.
# The README's scene, commands and program work as printed, in their order, in a folder with nothing else
# but the scenes that they name.
sed -n '/^```xml/,/^```/p' "$ROOT/README.md" | grep -v '^```' >ball.xml
sed -n 's/^    \(importon [^#]*\).*/\1/p' "$ROOT/README.md" >commands
ln -s "$ROOT/scenes" scenes || exit 9
while read -r line; do
    eval "$line" >answer 2>log || { echo "+ $line"; cat log; exit 9; }
    # what a newcomer would take for a failure
    grep -HniE 'warning|dropped|limit reached|not determined' answer log && echo "+ $line"
done <commands
sed -n '/^```c/,/^```/p' "$ROOT/README.md" | grep -v '^```' >program.c
cc -std=c11 -Wall -Wextra -Werror -I"$ROOT/include" -c program.c || exit 9
if ! nm -D "$BUILD/lib/libimporton.so" | grep -qE '__(asan|tsan|ubsan)'; then # those need flags of their own
    cc program.o -L"$BUILD/lib" -limporton -o program || exit 9
    LD_LIBRARY_PATH=$BUILD/lib ./program >answer || exit 9
    grep -qE '^loss [-0-9.e]+ \+- [0-9.e-]+, gradient [-0-9.e]+ [-0-9.e]+ [-0-9.e]+$' answer || cat answer
fi

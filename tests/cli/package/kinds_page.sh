# SPDX-License-Identifier: Apache-2.0
# The material that docs/kinds.md builds up compiles as printed, in the library; and the medium,
# against the installed headers alone (plugin.sh runs it).
awk '/^```c$/ { n++; on = n; next } /^```/ { on = 0 } on { print > "block" on ".c" }' "$ROOT/docs/kinds.md"
grep -q imp__minnaert block1.c || exit 9
cc -std=gnu11 -Wall -Wextra -Wno-psabi -Werror -I"$ROOT/include" -I"$ROOT/src" \
    -I"$ROOT/src/kind/bsdf" -fsyntax-only block1.c
grep -q 'imp_medium_ops mist' block2.c || exit 9
echo 'const struct imp_medium_ops *used(void); const struct imp_medium_ops *used(void) { return &mist; }' >>block2.c
cc -std=gnu11 -Wall -Wextra -Wpedantic -Werror -I"$ROOT/include" -fsyntax-only block2.c
[[ ! -e block3.c ]]

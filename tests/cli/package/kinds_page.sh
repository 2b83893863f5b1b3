# SPDX-License-Identifier: Apache-2.0
# The material that docs/kinds.md builds up compiles as printed.
sed -n '/^```c$/,/^```/p' "$ROOT/docs/kinds.md" | grep -v '^```' >minnaert.c
grep -q imp__minnaert minnaert.c || exit 9
cc -std=gnu11 -Wall -Wextra -Wno-psabi -Werror -I"$ROOT/include" -I"$ROOT/src" \
    -I"$ROOT/src/kind/bsdf" -fsyntax-only minnaert.c

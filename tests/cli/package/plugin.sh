# SPDX-License-Identifier: Apache-2.0
# Kinds are written against the installed headers alone, registered by a host, and give the
# pictures and gradients of closed forms; what cannot be registered is refused (plugin.c).
nm -D "$BUILD/lib/libimporton.so" | grep -qE '__(asan|tsan|ubsan)' && exit 0 # needs flags of its own
unset LD_LIBRARY_PATH
DESTDIR=$OUT/root meson install -C "$BUILD" --no-rebuild --quiet >/dev/null || exit 9
header=$(find "$OUT/root" -name kinds.h)
prefix=${header%/include/importon/kinds.h}
cp "$prefix/share/doc/importon/examples/own_material.c" "$ROOT/tests/cli/package/plugin.c" . || exit 9
awk '/^```c$/ { n++; on = n == 2; next } /^```/ { on = 0 } on' "$ROOT/docs/kinds.md" >mist.c
for level in x86-64 x86-64-v3; do # the library's own build need not be the plug-in's
    case $(uname -m) in x86_64) arch=-march=$level ;; *) arch= ;; esac
    [[ $level == x86-64-v3 ]] && ! grep -qw avx2 /proc/cpuinfo && continue
    cc -std=gnu11 -O1 -Wall -Wextra -Wpedantic -Werror $arch -I"$prefix/include" plugin.c \
        -L"$prefix/lib" -limporton -Wl,-rpath,"$prefix/lib" -lm -o "plugin-$level" || exit 9
    "./plugin-$level" | grep -vE '^ok|^1\.\.'
done
# A vector by value would be an interface that depends on those flags.
grep -hvE '^ +imp_v3 [a-z_, ]+;' "$header" "${header%kinds.h}lobes.h" | grep -E '(imp_spec|imp_v3) +\w+ *[,)]|^(imp_spec|imp_v3) +\w+\('
true

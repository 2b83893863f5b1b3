# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: plug-ins would need flags of their own.
# A plug-in that was compiled with another kinds.h. One in which structs of the first list and
# tables end earlier is taken, and passes every test of plugin.c; one of another version, with
# another size of a struct of the second list, or with a larger struct of the first is refused
# with a sentence that names the struct, both sizes and both versions.
unset LD_LIBRARY_PATH
cp -r "$ROOT/include" here
cp "$ROOT/examples/own_material.c" "$ROOT/tests/cli/package/plugin.c" . || exit 9
awk '/^```c$/ { n++; on = n == 2; next } /^```/ { on = 0 } on' "$ROOT/docs/kinds.md" >mist.c
cat >sizes.c <<'C'
#include <importon/kinds.h>
#include <stdio.h>
#include <string.h>
int main(void) /* structs that are smaller than the library's, and larger */
{
    const struct imp_kinds_layout *a = imp_kinds_here(), *b = imp_kinds_of_library();
    int smaller = 0, larger = 0;
    for (int i = 0; i < a->n; i++)
        for (int k = 0; k < b->n; k++)
            if (strcmp(a->structs[i].name, b->structs[k].name) == 0) {
                smaller += a->structs[i].size < b->structs[k].size;
                larger += a->structs[i].size > b->structs[k].size;
            }
    return printf("%d of %d structs are smaller, %d larger\n", smaller, a->n, larger) < 0;
}
C
# changed NAME <<CHANGES: a header NAME/importon/kinds.h; each line of changes is a struct, a
# field, and nothing (the struct ends before that field) or a declaration (it follows).
changed() {
    cp -r here "$1"
    python3 -c '
import re, sys
path = sys.argv[1] + "/importon/kinds.h"
text = open(path).read()
for line in sys.stdin:
    struct, field, more = (line.split(None, 2) + ["", ""])[:3]
    begin = text.index("\nstruct %s {" % struct)
    end = text.index("\n}", begin)
    body = text[begin:end]
    at = list(re.finditer(r"[^;{]*\b%s\b[^;]*;" % re.escape(field), re.sub(r"/\*.*?\*/", lambda m: " " * len(m[0]), body, flags=re.S)))
    assert len(at) == 1, (struct, field, len(at))
    body = body[:at[0].end()] + " " + more if more else body[:at[0].start()]
    text = text[:begin] + body.rstrip() + text[end:]
open(path, "w").write(text)' "$1" || exit 9
}
compile() {
    cc -std=gnu11 -O1 -Wall -Wextra -Wno-pedantic -Werror -I"$2" "$1.c" -L"$BUILD/lib" -limporton \
        -Wl,-rpath,"$BUILD/lib" -lm -o "$1-$2" || exit 9
}

changed older <<'END'
imp_bsdf straight
imp_emitter course
imp_emitter_ops cone
imp_input spectrum
imp_medium pure
imp_medium_ops boxed
imp_phase name
imp_sensor child
imp_shape placed
imp_texture asked
END
compile sizes older
compile plugin older
./sizes-older
./plugin-older | grep -vE '^ok|^1\.\.'

cp -r here newer
sed -i 's/^#define IMP_KINDS_VERSION 1$/#define IMP_KINDS_VERSION 2/' newer/importon/kinds.h
grep -q 'VERSION 2$' newer/importon/kinds.h || exit 9
compile own_material newer
./own_material-newer
echo "exit $?"

echo 'imp_surface uv imp_v3 dn_du;' | changed wider
echo 'imp_emitter course double colour;' | changed longer
for header in wider longer; do
    compile own_material $header
    ./own_material-$header
    echo "exit $?"
done

# A host in C++: its functions and the library's have the same names.
command -v g++ >/dev/null || exit 0
cat >host.cc <<'C'
#include <cstdio>
#include <importon/lobes.h>
static enum imp_status build(const imp_build *, void *, imp_filter *f)
{
    f->radius = 1;
    return IMP_OK;
}
static double eval(const imp_filter *, double x) { return 1 - (x < 0 ? -x : x); }
int main()
{
    imp_context *context = nullptr;
    imp_filter_ops hat = imp_filter_ops();
    hat.size = sizeof hat;
    hat.name = "hat";
    hat.build = build;
    hat.eval = eval;
    if (imp_context_create(nullptr, &context) != IMP_OK) return 1;
    const enum imp_status st = imp_register_filter(context, &hat);
    if (st != IMP_OK) std::puts(imp_last_error(context));
    imp_context_destroy(context);
    return st != IMP_OK;
}
C
g++ -std=c++11 -Wall -Wextra -Wpedantic -Werror -Ihere host.cc -L"$BUILD/lib" -limporton \
    -Wl,-rpath,"$BUILD/lib" -o host || exit 9
./host

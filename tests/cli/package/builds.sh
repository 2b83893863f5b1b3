# SPDX-License-Identifier: Apache-2.0
# The library for every x86-64, the one for x86-64-v3 and the one for x86-64-v4 give the same bits, and
# the loader takes the last that the processor can run.
every=$BUILD/lib/libimporton.so.0 v3=$BUILD/lib/glibc-hwcaps/x86-64-v3/libimporton.so.0
v4=$BUILD/lib/glibc-hwcaps/x86-64-v4/libimporton.so.0
[[ -e $v3 ]] || exit 0 # one build only (-Dcpu=)
nm -D "$every" | grep -qE '__(asan|tsan|ubsan)' && exit 0 # not to be preloaded
objdump -d --no-show-raw-insn "$every" | grep -m1 %ymm && echo "the library for every processor uses AVX"
objdump -d --no-show-raw-insn "$v3" | grep -m1 %zmm && echo "the v3 library uses AVX-512"
for library in "$v3" "$v4"; do
    objdump -d --no-show-raw-insn "$library" | grep -m1 -E 'vfn?m(add|sub)' && echo "$library uses FMA"
done
# can FLAG...: the processor has all of them.
can() {
    for flag in "$@"; do grep -m1 '^flags' /proc/cpuinfo | grep -qw "$flag" || return 1; done
}
can avx2 bmi2 fma || exit 0
best=v3
can avx512f avx512bw avx512cd avx512dq avx512vl && best=v4
# Meson's tests have the folders of all three libraries in LD_LIBRARY_PATH, in any order.
env -u LD_LIBRARY_PATH ldd "$(command -v importon)" | grep glibc-hwcaps/x86-64-$best >/dev/null || echo "the loader takes a slow one"

# answers COMMAND...: the numbers, without the time they took.
answers() {
    importon "$@" --json -q | sed 's/"seconds":[^,}]*//g'
}
# all NAME LIBRARY: pictures as floats without a header, gradients, a fit, bent rays, elements.
all() (
    export LD_PRELOAD=$2
    mkdir "$1" && cd "$1" || exit 9
    for scene in cornell textured lamps stam bend/seen elements/glossy; do
        size=(-D width=16)
        grep -q '"\$res"' "$ROOT/scenes/$scene.xml" && size=(-D res=16)
        importon render "$ROOT/scenes/$scene.xml" "${size[@]}" --spp 8 -q --no-preview \
            -o "$(basename $scene).pfm" || exit 9
        answers gradient "$ROOT/scenes/$scene.xml" "${size[@]}" --spp 4 >>gradients
    done
    importon render "$ROOT/scenes/cornell.xml" -D res=12 --spp 32 -q --no-preview -o target.pfm
    answers fit "$ROOT/scenes/cornell.xml" -D res=12 --spp 4 -T target.pfm -n 3 -p 'red.*' >fit
    answers bend trace "$ROOT/scenes/bend/luneburg.xml" >bend
    answers elements "$ROOT/scenes/elements/b.xml" -D res=16 --stop 10 --no-image >elements
    [[ -s gradients && -s fit && -s bend && -s elements ]] || exit 9
)
all every "$every" || exit 9
all v3 "$v3" || exit 9
diff -rq every v3
[[ $best == v4 ]] || exit 0
all v4 "$v4" || exit 9
diff -rq every v4

# SPDX-License-Identifier: Apache-2.0
# An installed program starts, and programs build against the installed tree and start,
# wherever it is: nothing is set for the loader. Docs and scenes come along.
nm -D "$BUILD/lib/libimporton.so" | grep -qE '__(asan|tsan|ubsan)' && exit 0 # needs flags of its own
unset LD_LIBRARY_PATH
# Where the tree lies is not where it was configured for: --define-prefix asks pkg-config to
# take the place of importon.pc instead.
DESTDIR=$OUT/root meson install -C "$BUILD" --no-rebuild --quiet >/dev/null || exit 9
pc=$(find "$OUT/root" -name importon.pc)
prefix=$OUT/root$(sed -n 's/^prefix=//p' "$pc")
for file in bin/importon include/importon/importon.h share/man/man1/importon.1 \
    share/man/man5/importon-scene.5 share/man/man3/libimporton.3 \
    share/importon/scenes/cornell/light.obj share/importon/scenes/bend/seen.xml \
    share/doc/importon/bend.md share/doc/importon/images/lenses.png \
    share/doc/importon/README.md share/doc/importon/examples/render.c \
    share/bash-completion/completions/importon; do
    [[ -f $prefix/$file ]] || echo "not installed: $file"
done
# What the manual pages name below the prefix is there.
for page in "$prefix"/share/man/man?/*; do
    sed -n 's/^\(\.It\|\.Pa\).*\(share\/[a-z/]*\).*/\2/p' "$page"
    sed -n 's/.*Pa \([a-z-]*\.md\) .*/share\/doc\/importon\/\1/p' "$page"
done | sort -u >named
grep -q share/importon/scenes named && grep -q bend.md named || echo "the manual names no files"
while read -r file; do
    [[ -e $prefix/$file ]] || echo "named by the manual, not installed: $file"
done <named

scene=$prefix/share/importon/scenes/furnace.xml
"$prefix/bin/importon" render "$scene" --spp 1 -q --no-preview -o a.exr || exit 9
[[ -s a.exr ]] || exit 9
export PKG_CONFIG_PATH=${pc%/*}
flags() { pkg-config --define-prefix "$@" importon; }
cc "$ROOT/examples/render.c" $(flags --cflags --libs) -o by_pkg_config || exit 9
./by_pkg_config "$scene" b.exr || exit 9
[[ $(flags --cflags | xargs) == "-I$prefix/include" ]] || flags --cflags
cc "$ROOT/examples/render.c" $(flags --cflags) "${pc%/*}/../libimporton.a" \
    $(flags --static --libs) -o by_archive || exit 9
./by_archive "$scene" c.exr || exit 9

# A prefix that was configured: its importon.pc as it is. The build folder keeps its own.
sed "s|^prefix=.*|prefix=$prefix|" "$pc" >importon.pc
PKG_CONFIG_PATH=. cc "$ROOT/examples/render.c" $(PKG_CONFIG_PATH=. pkg-config --cflags --libs importon) -o by_prefix || exit 9
./by_prefix "$scene" d.exr || exit 9

command -v cmake >/dev/null || exit 0
cat >CMakeLists.txt <<END
cmake_minimum_required(VERSION 3.13)
project(host C)
find_package(importon 0.2 REQUIRED)
add_executable(by_cmake $ROOT/examples/render.c)
target_link_libraries(by_cmake importon::importon)
END
cmake -G Ninja -B cmake-build -DCMAKE_PREFIX_PATH="$prefix" >cmake.log 2>&1 &&
    cmake --build cmake-build >>cmake.log 2>&1 || { cat cmake.log; exit 9; }
cmake-build/by_cmake "$scene" e.exr

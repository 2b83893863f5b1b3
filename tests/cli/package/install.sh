# SPDX-License-Identifier: Apache-2.0
# A program builds against the installed tree with pkg-config and with CMake, and runs.
nm -D "$BUILD/lib/libimporton.so" | grep -qE '__(asan|tsan|ubsan)' && exit 0 # needs flags of its own
DESTDIR=$OUT/root meson install -C "$BUILD" --no-rebuild --quiet >/dev/null || exit 9
pc=$(find "$OUT/root" -name importon.pc)
prefix=$OUT/root$(sed -n 's/^prefix=//p' "$pc")
for file in bin/importon include/importon/importon.h share/man/man1/importon.1 \
    share/man/man5/importon-scene.5 share/man/man3/libimporton.3 \
    share/importon/scenes/cornell/light.obj share/bash-completion/completions/importon; do
    [[ -f $prefix/$file ]] || echo "not installed: $file"
done
export PKG_CONFIG_PATH=${pc%/*} PKG_CONFIG_SYSROOT_DIR=$OUT/root LD_LIBRARY_PATH=${pc%/*}/..
cc "$ROOT/examples/render.c" $(pkg-config --cflags --libs importon) -o by_pkg_config || exit 9
./by_pkg_config "$prefix/share/importon/scenes/furnace.xml" a.exr || exit 9
[[ -s a.exr ]] || exit 9
command -v cmake >/dev/null || exit 0
cat >CMakeLists.txt <<END
cmake_minimum_required(VERSION 3.13)
project(host C)
find_package(importon 0.1 REQUIRED)
add_executable(by_cmake $ROOT/examples/render.c)
target_link_libraries(by_cmake importon::importon)
END
cmake -G Ninja -B cmake-build -DCMAKE_PREFIX_PATH="$prefix" >cmake.log 2>&1 &&
    cmake --build cmake-build >>cmake.log 2>&1 || { cat cmake.log; exit 9; }
cmake-build/by_cmake "$prefix/share/importon/scenes/furnace.xml" b.exr

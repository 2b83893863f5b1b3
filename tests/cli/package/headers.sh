# SPDX-License-Identifier: Apache-2.0
# Each public header compiles alone, as C11 and as C++, under strict warnings.
for header in importon kinds elements bend; do
    echo "#include <importon/$header.h>" >alone.c
    echo "#include <importon/$header.h>" >alone.cc
    for cc in gcc clang; do
        command -v $cc >/dev/null || continue
        $cc -std=c11 -Wall -Wextra -Wpedantic -Werror -I"$ROOT/include" -c alone.c -o alone.o
    done
    for cxx in g++ clang++; do
        command -v $cxx >/dev/null || continue
        $cxx -std=c++11 -Wall -Wextra -Wpedantic -Werror -I"$ROOT/include" -c alone.cc -o alone.o
    done
done

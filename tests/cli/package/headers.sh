# SPDX-License-Identifier: Apache-2.0
# Each public header compiles alone, as C11 and as C++11 and C++20, under strict warnings, and with it every
# initialiser: IMP_RUN_INIT is one of struct imp_run.
n=0
for header in importon kinds lobes elements bend clip until walks report rooms design mpi; do
    echo "#include <importon/$header.h>" >alone.c
    for init in $(sed -nE 's/^#define (IMP_\w+_INIT)( .*|)$/\1/p' "$ROOT/include/importon/$header.h"); do
        name=${init%_INIT}
        echo "size_t use_${name,,}(void); size_t use_${name,,}(void) { struct ${name,,} v = $init; return v.size; }"
        n=$((n + 1))
    done >>alone.c
    cp alone.c alone.cc
    for cc in gcc clang; do
        command -v $cc >/dev/null || continue
        $cc -std=c11 -Wall -Wextra -Wpedantic -Werror -I"$ROOT/include" -c alone.c -o alone.o
    done
    for cxx in g++ clang++; do
        command -v $cxx >/dev/null || continue
        for standard in c++11 c++20; do
            $cxx -std=$standard -Wall -Wextra -Wpedantic -Werror -I"$ROOT/include" -c alone.cc -o alone.o
        done
    done
done
((n >= 40)) || echo "only $n initialisers were found"

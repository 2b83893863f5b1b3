#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Fuzz every target, or those that are named, with libFuzzer under ASan and UBSan.
#
#     fuzz/run.sh [-s SECONDS] [NAME...]    of fuzz/fuzz_NAME.c; 60 seconds each by default
#
# New inputs stay in build-fuzz/corpus/NAME; what fails is written to build-fuzz/crash-*.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=60
while getopts s: option; do
    case $option in
        s) seconds=$OPTARG ;;
        *) exit 2 ;;
    esac
done
shift $((OPTIND - 1))
[[ -f build-fuzz/build.ninja ]] ||
    CC=clang meson setup build-fuzz -Dcpu=native -Db_sanitize=address,undefined -Db_lundef=false \
        -Dbuildtype=debugoptimized
targets=("$@")
((${#targets[@]})) || mapfile -t targets < <(printf '%s\n' fuzz/fuzz_*.c | sed 's/.*fuzz_//; s/\.c$//')
ninja -C build-fuzz "${targets[@]/#/fuzz/fuzz_}"
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
export LSAN_OPTIONS=suppressions=$PWD/tools/lsan.supp
for name in "${targets[@]}"; do
    mkdir -p "build-fuzz/corpus/$name"
    "build-fuzz/fuzz/fuzz_$name" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=4096 \
        -artifact_prefix=build-fuzz/ -print_final_stats=1 \
        "build-fuzz/corpus/$name" "fuzz/corpus/$name"
done

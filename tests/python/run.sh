#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
#     tests/python/run.sh BUILD NAME [MODULE...]
#
# Run tests/python/NAME.py on the package in BUILD, by the first Python that has NumPy and the
# modules: $IMP_PYTHON (./test --long makes one with torch and JAX), python3, Debian's.
# $IMP_PRELOAD: a sanitizer's runtime, which the interpreter does not have.
set -uo pipefail
build=$1 name=$2
shift 2
here=$(cd "$(dirname "$0")" && pwd)
export PYTHONPATH=$build/python:$here PYTHONDONTWRITEBYTECODE=1 IMP_BUILD=$build
modules=$(printf 'import %s\n' numpy "$@")
for python in "${IMP_PYTHON-}" python3 /usr/bin/python3; do
    if [[ -n $python ]] && "$python" -c "$modules" 2>/dev/null; then
        if [[ -n ${IMP_PRELOAD-} ]]; then
            export LD_PRELOAD=$IMP_PRELOAD ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1 PYTHONMALLOC=malloc
        fi
        exec "$python" "$here/$name.py"
    fi
done
echo "1..0 # SKIP no python3 has the modules numpy $*"

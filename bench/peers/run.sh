#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
#
# Speed against Mitsuba 3, and agreement with it: bench/peers/run.sh [speed|agree|gradients]
# Everything by default. PYTHON names a python3 that can import mitsuba; IMPORTON the command.
# Dr.Jit finds LLVM by itself, or through DRJIT_LIBLLVM_PATH. Skips (77) without mitsuba.
set -u
here=$(dirname "$0")
python=${PYTHON:-python3}
importon=${IMPORTON:-$here/../../build/cli/importon}
what=${1:-all}

if ! "$python" -c 'import mitsuba, numpy, scipy' 2>/dev/null; then
    echo "SKIP: $python has no mitsuba, numpy and scipy" >&2
    exit 77
fi
status=0
case $what in speed | all) "$python" "$here/peers.py" -i "$importon" || status=1 ;; esac
case $what in agree | all) "$python" "$here/zcompare.py" -i "$importon" || status=1 ;; esac
case $what in gradients | all) "$python" "$here/gradients.py" -i "$importon" || status=1 ;; esac
exit $status

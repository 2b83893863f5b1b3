# SPDX-License-Identifier: Apache-2.0
# kinds.h keeps what plug-ins of its version were compiled with (kinds_abi.py); and what breaks
# them is seen: a field that moves, one in the padding, a flag with another number, a struct of
# an array that grows. A struct of the first list may grow at its end.
abi="$ROOT/tests/cli/package/kinds_abi"
"$abi.py" "$ROOT/include/importon/kinds.h" "$abi.txt" || exit 9
cp -r "$ROOT/include" kept
# try WHAT, SED SCRIPT: of a header changed so.
try() {
    rm -rf changed
    cp -r kept changed
    sed -i -E "$2" changed/importon/kinds.h
    cmp -s kept/importon/kinds.h changed/importon/kinds.h && exit 8
    echo "+ $1"
    "$abi.py" changed/importon/kinds.h "$abi.txt"
}
try "a field in the middle" 's/^(    int count; .*numbers of a constant)/    int first;\n\1/'
try "a field in the padding" '/^struct imp_carried \{/,/^\}/s/^    int n;/    int n, first;/'
try "a flag" 's/^    IMP_BSDF_NULL = 32,/    IMP_BSDF_NULL = 256,/'
try "an element of arrays" '/^struct imp_input_desc \{/,/^\}/s/^    const char \*unit;/&\n    double step;/'
try "a function gone" '/^struct imp_phase_ops \{/,/^\}/s/^    enum imp_status \(\*prepare\).*$//'
try "an end that grows" '/^struct imp_phase \{/,/^\}/s/^    const char \*name;/&\n    double later;/'
try "a version" 's/^#define IMP_KINDS_VERSION .*/#define IMP_KINDS_VERSION 99/'
true

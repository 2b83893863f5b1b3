# SPDX-License-Identifier: Apache-2.0
# tools/check_abi.py lets a released interface grow, and names each thing that would break a program that
# was compiled with it.
copy() { # headers of a later version, after a change: sed COMMAND in FILE of include/importon
    rm -rf t && mkdir -p t/tools t/tests t/lib && cp -r "$ROOT/include" t && cp -r "$ROOT/tests/abi" t/tests &&
        cp "$ROOT/tools/check_abi.py" t/tools && cp "$ROOT/lib/importon.map" t/lib || exit 9
    sed -i 's/^#define IMP_VERSION_STRING .*/#define IMP_VERSION_STRING "9.9.9"/' t/include/importon/importon.h
    [ $# = 0 ] || sed -i "$1" "t/include/importon/$2.h"
    python3 t/tools/check_abi.py $3 2>&1 | sed 's/ (since .*//' | head -n 3
}
echo "+ nothing changed"; copy
echo "+ a member behind the end of a sized struct: recorded, and the struct is as old as before"
copy 's/^    const imp_walks \*walks;/&\n    double more;/' importon --update
python3 t/tools/check_abi.py
grep -c '^9.9.9' t/tests/abi/importon.txt
echo "+ a new function"
copy 's/^IMP_API int imp_context_threads/IMP_API int imp_context_more(void);\n&/' importon --update
grep -A2 '9.9.9' t/lib/importon.map
echo "+ a function with another argument"
copy 's/^IMP_API int imp_context_threads(const imp_context \*context)/IMP_API int imp_context_threads(int n)/' importon --update
echo "+ a function that is gone"
copy 's/^IMP_API int imp_context_threads(const imp_context \*context);//' importon
echo "+ a member in the padding of a sized struct, which older programs leave as it is"
copy 's/^    bool no_recording;/& bool more;/' importon
echo "+ a member more in a closed struct"
copy 's/^    double value, se;$/    double value, se, more;/' importon
echo "+ another value of an enumerator"
copy 's/IMP_ADAM = 0,/IMP_ADAM = 7,/' importon

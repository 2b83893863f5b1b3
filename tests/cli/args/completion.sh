# SPDX-License-Identifier: Apache-2.0
# Completion knows commands, options, the words an option takes, verbs, parameters of the scene, and files.
. "$ROOT/packaging/importon.bash"
cp "$ROOT/scenes/furnace.xml" .
touch photo.exr
try() {
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    _importon
    printf '%s:' "$*"; printf '%s\n' "${COMPREPLY[@]}" | sort | paste -sd ' '
}
try importon ren
try importon help el
try importon fit --opti
try importon fit --optimizer l
try importon fit furnace.xml --loss ''
try importon bend f
try importon bend view -q --optimizer m
try importon gradient furnace.xml -p ball
try importon gradient furnace.xml --set sky
try importon fit furnace.xml --target ph
try importon fit furnace.xml --spp ''
try importon render f
importon help fit --optimiser

# SPDX-License-Identifier: Apache-2.0
# A damaged list of settings is refused with its file and line, and never read in part.
cd "$SCENES" || exit 9
try() {
    printf "$1" >"$OUT/set.txt"
    (cd "$OUT" && importon info "$SCENES/furnace.xml" --set @set.txt 2>&1 >/dev/null | sed "s|$SCENES/||"; exit "${PIPESTATUS[0]}")
    echo "exit $?"
}
try '# good\r\n\nball.reflectance.value=0.25\n'
try 'ball.reflectance.value=0.25'
try '\n\nball.refl'
try '# two lines\nball.reflectance.value=0.2,x\n'
try 'ball.reflectance.value=0.2 0.3\n'
try 'ball.reflectance.value=\n'
try 'ball.reflectance.value=nan\n'
try 'ball.reflectance.value=2\n'
try 'bal.reflectance.value=0.2\n'
try 'ball.reflectance.value=0.2,0.3\n'
try 'ball.reflectance.value=0.25\nball\000.reflectance.value=0.2\n'
importon info furnace.xml --set @/dev/zero 2>&1
echo "exit $?"
importon info furnace.xml --set "@$SCENES" 2>&1
echo "exit $?"

# SPDX-License-Identifier: Apache-2.0
importon render "$ROOT/scenes/cornell.xml" -D res=16 --pixel 8,8 --sample 2 | grep -q . || exit 9
importon render "$ROOT/scenes/cornell.xml" -D res=16 --pixel 8,8 --sample 2 --json | python3 -m json.tool >/dev/null || exit 9
cd "$ROOT/scenes" && importon render cornell.xml -D res=16 --pixel 16,0

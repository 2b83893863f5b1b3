# SPDX-License-Identifier: Apache-2.0
# -D sets a $parameter of the file; one that the file does not have is an error.
cd "$SCENES" || exit 9
importon info --json -D res=5 "$ROOT/scenes/furnace.xml" | grep -o '"width":5,"height":5' || exit 9
importon info -D rse=5 furnace.xml

# SPDX-License-Identifier: Apache-2.0
importon compare a.exr
echo "exit $?" >&2
importon info a.xml b.xml
echo "exit $?" >&2
importon jacobian "$ROOT/scenes/furnace.xml"

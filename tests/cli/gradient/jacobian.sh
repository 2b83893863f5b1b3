# SPDX-License-Identifier: Apache-2.0
# One picture per control, with its preview.
importon jacobian -m mono "$ROOT/scenes/stam.xml" -D res=8 --spp 16 -q -o J >/dev/null || exit 9
ls J | grep exr

# SPDX-License-Identifier: Apache-2.0
# The gradient of a texture is a picture of its size.
importon gradient "$ROOT/scenes/textured.xml" -D width=16 -D height=12 --spp 8 -q -p 'floor.*' --textures G >/dev/null || exit 9
ls G

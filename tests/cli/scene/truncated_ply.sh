# SPDX-License-Identifier: Apache-2.0
cd "$SCENES" || exit 9
importon info truncated_ply.xml

# SPDX-License-Identifier: Apache-2.0
cd "$SCENES" || exit 9
importon info wrong_type.xml

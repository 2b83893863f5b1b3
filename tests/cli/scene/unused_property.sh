# SPDX-License-Identifier: Apache-2.0
# What no object asks for is an error with file, line and column.
cd "$SCENES" || exit 9
importon render --dump unused_property.xml

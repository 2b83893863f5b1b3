# SPDX-License-Identifier: Apache-2.0
# The error says what is supported.
cd "$SCENES" || exit 9
importon info unknown_plugin.xml

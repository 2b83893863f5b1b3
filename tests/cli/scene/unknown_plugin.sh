# SPDX-License-Identifier: Apache-2.0
# The error says what is supported.
cd "$SCENES" || exit 9
importon render --dump unknown_plugin.xml

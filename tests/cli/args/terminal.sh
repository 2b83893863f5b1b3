# SPDX-License-Identifier: Apache-2.0
# What is quoted cannot move a terminal's cursor.
importon info $'\e[2J\r\x7f'

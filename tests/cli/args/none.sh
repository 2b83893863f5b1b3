# SPDX-License-Identifier: Apache-2.0
# No command: the usage, and an error.
importon

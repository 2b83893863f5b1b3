# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: its commands are run there by other transcripts.
# The first lesson and the page of rooms print what the program prints.
python3 "$ROOT/tools/run_page.py" "$ROOT/docs/learn.md" "$ROOT/docs/rooms.md" "$ROOT/docs/design.md"

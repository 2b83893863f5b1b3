# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: its commands are run there by other transcripts.
# The page of measurements prints what the program prints.
python3 "$ROOT/tools/run_page.py" "$ROOT/docs/measure.md"

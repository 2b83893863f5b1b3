# SPDX-License-Identifier: Apache-2.0
# --quiet leaves nothing on a terminal but errors: no progress bar either.
python3 - <<'P'
import os, pty, subprocess
def stderr_of(*words):
    master, slave = pty.openpty()
    run = subprocess.run(["importon", *words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=slave)
    os.close(slave)
    text = b""
    try:
        while True:
            more = os.read(master, 4096)
            if not more: break
            text += more
    except OSError: pass
    return text
scene = os.environ["ROOT"] + "/scenes/furnace.xml"
render = ["render", scene, "--spp", "256", "-o", "x.exr"]
assert b"\r" in stderr_of(*render)
assert stderr_of(*render, "-q") == b"", stderr_of(*render, "-q")
assert stderr_of(*render, "-q", "--progress", "always") == b""
P

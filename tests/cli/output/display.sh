# SPDX-License-Identifier: Apache-2.0
# A viewer is shown the picture while it is made, with its errors, and in the end what is written.
cat >viewer.py <<'END'
import socket, struct, sys
import numpy as np

server = socket.socket()
server.bind(("127.0.0.1", 0))
server.listen()
print(server.getsockname()[1], file=open("port", "w"), flush=True)
stream = server.accept()[0].makefile("rb")
images, updates = {}, 0
while head := stream.read(4):
    data = stream.read(struct.unpack("<I", head)[0] - 4)
    at = 0

    def take(form):
        global at
        at += struct.calcsize("<" + form)
        return struct.unpack("<" + form, data[at - struct.calcsize("<" + form):at])

    def text():
        global at
        end = data.index(b"\0", at)
        word, at = data[at:end].decode(), end + 1
        return word

    kind, focus = take("bb")
    name = text()
    if kind == 4:
        width, height, n = take("iii")
        names = [text() for _ in range(n)]
        images[name] = (names, np.full((height, width, n), np.nan, "f4"))
    else:
        assert kind == 6, kind
        (n,) = take("i")
        assert [text() for _ in range(n)] == images[name][0]
        x, y, w, h = take("iiii")
        offset, stride = take("%dq" % n), take("%dq" % n)
        values = np.frombuffer(data[at:], "<f4")
        for c in range(n):
            images[name][1][y:y + h, x:x + w, c] = values[offset[c]:][:stride[c] * (w * h - 1) + 1:stride[c]].reshape(h, w)
        updates += y + h == images[name][1].shape[0]
for name, (names, pixels) in images.items():
    print(name, *names, "whole" if np.isfinite(pixels).all() else "with holes", updates)
    np.save("shown.npy", pixels[:, :, :3])
END
python3 viewer.py >seen &
for ((k = 0; k < 100; k++)); do [[ -s port ]] && break; sleep 0.1; done
importon render "$ROOT/scenes/furnace.xml" -D res=24 --spp 256 -q --display "127.0.0.1:$(<port)" -o picture.npy || exit 9
wait
cat seen
python3 -c 'import numpy as np; print(np.array_equal(np.load("shown.npy"), np.load("picture.npy")))'
# Nobody there, and no address.
importon render "$ROOT/scenes/furnace.xml" -D res=8 --display "127.0.0.1:$(<port)" -o no.exr 2>&1 | sed 's/:[0-9]*:/:PORT:/'
importon render "$ROOT/scenes/furnace.xml" -D res=8 --display tev -o no.exr
# A viewer that goes away ends nothing.
python3 -c 'import socket
s = socket.socket(); s.bind(("127.0.0.1", 0)); s.listen()
print(s.getsockname()[1], file=open("port2", "w"), flush=True)
s.accept()[0].close()' &
for ((k = 0; k < 100; k++)); do [[ -s port2 ]] && break; sleep 0.1; done
importon render "$ROOT/scenes/furnace.xml" -D res=64 --spp 512 --display "127.0.0.1:$(<port2)" -o gone.exr 2>&1 | sed 's/is gone:.*/is gone/'
ls gone.exr

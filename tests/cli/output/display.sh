# SPDX-License-Identifier: Apache-2.0
# A viewer is shown the picture while it is made, with its errors, and in the end what is written.
cat >viewer.py <<'END'
import array, socket, struct

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
        images[name] = (names, width, array.array("f", [float("nan")]) * (width * height * n))
    else:
        assert kind == 6, kind
        (n,) = take("i")
        assert [text() for _ in range(n)] == images[name][0]
        x, y, w, h = take("iiii")
        offset, stride = take("%dq" % n), take("%dq" % n)
        values = array.array("f", data[at:])
        _, width, pixels = images[name]
        for i in range(w * h):
            for c in range(n):
                pixels[((y + i // w) * width + x + i % w) * n + c] = values[offset[c] + i * stride[c]]
        updates += (y + h) * width * n == len(pixels)
for name, (names, width, pixels) in images.items():
    n = len(names)
    print(name, *names, "with holes" if any(v != v for v in pixels) else "whole", updates)
    rows = [[pixels[(y * width + x) * n + c] for x in range(width) for c in range(3)] for y in range(len(pixels) // n // width)]
    with open("shown.pfm", "wb") as file: # PFM has its rows from the bottom up
        file.write(b"PF\n%d %d\n-1.0\n" % (width, len(rows)))
        for row in reversed(rows): file.write(struct.pack("<%df" % len(row), *row))
END
python3 viewer.py >seen &
for ((k = 0; k < 100; k++)); do [[ -s port ]] && break; sleep 0.1; done
importon render "$ROOT/scenes/furnace.xml" -D res=24 --spp 256 -q --display "127.0.0.1:$(<port)" -o picture.pfm || exit 9
wait
cat seen
cmp <(tail -c 6912 shown.pfm) <(tail -c 6912 picture.pfm) && echo same
# Derivatives and their errors, as layers of one picture and one by one.
rm port
python3 viewer.py >seen &
for ((k = 0; k < 100; k++)); do [[ -s port ]] && break; sleep 0.1; done
importon jacobian "$ROOT/scenes/furnace.xml" -D res=8 --spp 4 -q -p 'ball.*' --display "127.0.0.1:$(<port)" -o J --layers J.exr >/dev/null || exit 9
wait
cat seen
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
# Nor does one that takes nothing, and a run that it holds up hears a signal at once.
cat >deaf.py <<'END'
import socket, time
s = socket.socket()
s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
s.bind(("127.0.0.1", 0))
s.listen()
print(s.getsockname()[1], file=open("port3", "w"), flush=True)
c = s.accept()[0]
time.sleep(60)
END
python3 deaf.py &
deaf=$!
for ((k = 0; k < 100; k++)); do [[ -s port3 ]] && break; sleep 0.1; done
importon render "$ROOT/scenes/furnace.xml" -D res=1024 --spp 1 --display "127.0.0.1:$(<port3)" -o deaf.pfm --no-preview 2>&1 | grep gone
ls deaf.pfm
kill $deaf
rm port3
python3 deaf.py &
deaf=$!
for ((k = 0; k < 100; k++)); do [[ -s port3 ]] && break; sleep 0.1; done
SECONDS=0
importon render "$ROOT/scenes/furnace.xml" -D res=1024 --spp 1 -q --display "127.0.0.1:$(<port3)" -o deaf.pfm --no-preview 2>/dev/null &
run=$!
sleep 4
kill -TERM $run
wait $run
((SECONDS < 8)) && echo "heard"
kill $deaf

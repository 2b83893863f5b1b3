# SPDX-License-Identifier: Apache-2.0
# Without a denoiser the command is refused before it renders; where the denoiser fails, the
# picture is kept.
mkdir none broken
: >none/libOpenImageDenoise.so.2
LD_LIBRARY_PATH=none importon render --denoise --no-preview "$ROOT/scenes/furnace.xml" -D res=8 -o a.exr
echo "exit $?"; ls

for f in SetDeviceInt SetDeviceBool CommitDevice ReleaseDevice NewFilter SetSharedFilterImage SetFilterBool \
    CommitFilter ExecuteFilter ReleaseFilter; do
    echo "void oidn$f(void) {}"
done >broken.c
cat >>broken.c <<'C'
void *oidnNewDevice(int type) { return type == 1 ? 0 : &oidnNewDevice; }
int oidnGetDeviceError(void *device, const char **message) { *message = "broken"; return device == 0; }
C
${CC:-cc} -w -shared -fPIC broken.c -o broken/libOpenImageDenoise.so.2
LD_LIBRARY_PATH=broken importon render --denoise --no-preview "$ROOT/scenes/furnace.xml" -D res=8 -o a.exr
echo "exit $?"
importon render -q --no-preview "$ROOT/scenes/furnace.xml" -D res=8 -o b.exr
importon compare a.exr b.exr
echo "exit $?"

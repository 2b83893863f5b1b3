/* SPDX-License-Identifier: Apache-2.0
 *
 * Random numbers as a pure function of integers: imp__u01(key, dim), key made from (seed,
 * pixel, sample). Nothing to copy or rewind; a replay is the same call again. The mixing
 * is the finaliser of SplitMix64 (Steele, Lea, Flood 2014, variant 13 of Stafford),
 * applied to a Weyl sequence in `dim` from a start that is itself mixed from the key's
 * three integers. */
#ifndef IMP_MATH_RNG_H
#define IMP_MATH_RNG_H

#include <stdint.h>

static inline uint64_t imp__mix64(uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

struct imp_key {
    uint64_t state;
};

/* In two steps: what the keys of a pixel have in common, and one of them. */
#define IMP_KEY_SAMPLE 0x8cb92ba72f3d8dd7u
static inline uint64_t imp__key_pixel(uint64_t seed, uint64_t pixel)
{
    const uint64_t h = imp__mix64(seed + 0x9e3779b97f4a7c15u);
    return imp__mix64(h ^ (pixel + 0xd1b54a32d192ed03u));
}
static inline struct imp_key imp__key(uint64_t seed, uint64_t pixel, uint64_t sample)
{
    const uint64_t h = imp__key_pixel(seed, pixel);
    return (struct imp_key){imp__mix64(h ^ (sample + IMP_KEY_SAMPLE))};
}

/* The key of branch i (from 1) that leaves a walk at a vertex. */
static inline struct imp_key imp__key_branch(struct imp_key key, int vertex, int i)
{
    const uint64_t where = (uint64_t)vertex << 32 | (uint32_t)i;
    return (struct imp_key){imp__mix64(key.state ^ (where + 0xa0761d6478bd642fu))};
}

/* Uniform on [0, 1), 53 bits. */
static inline double imp__u01(struct imp_key key, uint32_t dim)
{
    const uint64_t z = imp__mix64(key.state + (uint64_t)(dim + 1) * 0x9e3779b97f4a7c15u);
    return (double)(z >> 11) * 0x1p-53;
}

#endif

/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of files that begin with their lowest byte, on any host. */
#ifndef IMP_BASE_LITTLE_H
#define IMP_BASE_LITTLE_H

#include <stdint.h>
#include <string.h>

static inline uint32_t imp__little_u32(const unsigned char *b)
{
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 |
           (uint32_t)b[3] << 24;
}
static inline uint64_t imp__little_u64(const unsigned char *b)
{
    return imp__little_u32(b) | (uint64_t)imp__little_u32(b + 4) << 32;
}
static inline int32_t imp__little_i32(const unsigned char *b)
{
    const uint32_t bits = imp__little_u32(b);
    int32_t i;
    memcpy(&i, &bits, sizeof i);
    return i;
}
static inline float imp__little_float(const unsigned char *b)
{
    const uint32_t bits = imp__little_u32(b);
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}
static inline double imp__little_double(const unsigned char *b)
{
    const uint64_t bits = imp__little_u64(b);
    double f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

#endif

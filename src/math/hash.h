/* SPDX-License-Identifier: Apache-2.0
 *
 * A running hash of bytes, for fingerprints and checksums: it distinguishes files
 * and scenes, and resists no attacker. */
#ifndef IMP_MATH_HASH_H
#define IMP_MATH_HASH_H

#include <stddef.h>
#include <stdint.h>

uint64_t imp__hash(uint64_t h, const void *bytes, size_t n);
/* Another hash, for large arrays: four at a time, as fast as memory is read from. */
uint64_t imp__hash_array(uint64_t h, const void *bytes, size_t n);
/* With the zero at its end: "ab", "c" differs from "a", "bc". NULL is as good as "". */
uint64_t imp__hash_text(uint64_t h, const char *text);

#endif

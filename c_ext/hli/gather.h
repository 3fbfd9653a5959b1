/* Many numbers of the memory at once, each as a double. */
#ifndef HLI_GATHER_H
#define HLI_GATHER_H
#include <stdint.h>

/* cdef begin */
/* What a number is in the memory. */
#define HS_I8 1
#define HS_U8 2
#define HS_I16 3
#define HS_U16 4
#define HS_I32 5
#define HS_U32 6
#define HS_I64 7
#define HS_U64 8
#define HS_F32 9
#define HS_F64 10

/* One number: where it stands, what it is, by what it is multiplied, and its
 * place among the doubles. */
typedef struct hs_item {
    const void *from;
    double scale;
    uint32_t kind, place;
} hs_item;
/* Every item into its place of `to`; an unknown kind gives 0. */
void hs_gather(const hs_item *items, uint32_t count, double *to);
/* Bit i: unit i of the array has please_rw TRUE (TECHNO_UNIT_CH, at most 64).
 */
uint64_t hs_techno_offered(const void *units, uint32_t count);
/* cdef end */

#endif

/* What the samples take from C's strings; Rust's library for WebAssembly has it under the same names. */
#ifndef SINEW_WEB_STRING_H
#define SINEW_WEB_STRING_H

#include <stddef.h>

void *memcpy(void *to, const void *from, size_t size);
void *memset(void *to, int byte, size_t size);

#endif

/* An RGB picture as a PNG, not compressed: what a program without a picture library can do in forty lines. */
#ifndef SINEW_VIEWER_PNG_H
#define SINEW_VIEWER_PNG_H

#include <stdint.h>
#include <stdio.h>

typedef struct png_file { FILE *file; uint32_t crc, a, b; } png_file; /* the sums of a chunk and of all data */

static inline void png_byte(png_file *to, uint32_t byte) {
  int bit;
  to->crc ^= byte & 255;
  for (bit = 0; bit < 8; bit++) to->crc = to->crc & 1 ? to->crc >> 1 ^ 0xedb88320u : to->crc >> 1;
  fputc((int)(byte & 255), to->file);
}

static inline void png_word(png_file *to, uint32_t word) {
  int shift;
  for (shift = 24; shift >= 0; shift -= 8) png_byte(to, word >> shift);
}

static inline void png_begin(png_file *to, uint32_t length, const char *name) {
  png_word(to, length);
  to->crc = 0xffffffffu;
  while (*name) png_byte(to, (uint32_t)*name++);
}

static inline void png_end(png_file *to) { png_word(to, ~to->crc); }

static inline void png_data(png_file *to, uint32_t byte) {
  png_byte(to, byte);
  to->a = (to->a + byte) % 65521, to->b = (to->b + to->a) % 65521;
}

/* Rows from below, as OpenGL reads them; each is a stored block, so that width is below 21845. 0: it could not be written. */
static inline int png_save(const char *path, const unsigned char *rgb, uint32_t width, uint32_t height) {
  const uint32_t row = 3 * width + 1;
  png_file to = {NULL, 0, 1, 0};
  uint32_t y, x;
  if ((to.file = fopen(path, "wb")) == NULL) return 0;
  fwrite("\x89PNG\r\n\x1a\n", 1, 8, to.file);
  png_begin(&to, 13, "IHDR"), png_word(&to, width), png_word(&to, height);
  png_byte(&to, 8), png_byte(&to, 2), png_byte(&to, 0), png_byte(&to, 0), png_byte(&to, 0), png_end(&to);
  png_begin(&to, 2 + height * (row + 5) + 4, "IDAT"), png_byte(&to, 0x78), png_byte(&to, 1);
  for (y = 0; y < height; y++) {
    png_byte(&to, y + 1 == height), png_byte(&to, row), png_byte(&to, row >> 8), png_byte(&to, ~row), png_byte(&to, ~row >> 8);
    png_data(&to, 0);
    for (x = 0; x < 3 * width; x++) png_data(&to, rgb[(size_t)(height - 1 - y) * 3 * width + x]);
  }
  png_word(&to, to.b << 16 | to.a), png_end(&to);
  png_begin(&to, 0, "IEND"), png_end(&to);
  return fclose(to.file) == 0;
}

#endif

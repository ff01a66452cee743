/* Writes an RGB picture as a PNG: rows as differences from the row above, equal bytes as runs, in fixed Huffman codes. */
#ifndef SINEW_SAMPLES_PNG_H
#define SINEW_SAMPLES_PNG_H

#include "../apng.h"

typedef struct png_bits {
  uint8_t *bytes;
  size_t count;
  uint32_t held, held_count;
} png_bits;

static inline void png_put(png_bits *to, uint32_t value, uint32_t count) {
  to->held |= value << to->held_count;
  to->held_count += count;
  for (; to->held_count >= 8; to->held_count -= 8, to->held >>= 8) to->bytes[to->count++] = (uint8_t)to->held;
}

/* A code of deflate's fixed table; codes start with their highest bit. */
static inline void png_code(png_bits *to, uint32_t symbol) {
  const uint32_t length = symbol < 144 ? 8 : symbol < 256 ? 9 : symbol < 280 ? 7 : 8;
  const uint32_t code = symbol < 144 ? 48 + symbol : symbol < 256 ? 256 + symbol : symbol < 280 ? symbol - 256 : symbol - 88;
  for (uint32_t bit = length; bit-- > 0;) png_put(to, code >> bit & 1, 1);
}

/* Writes directory/name; `rgb` has its lowest row first, as OpenGL reads it. */
static inline void png_save(const char *directory, const char *name, const uint8_t *rgb, uint32_t width,
                            uint32_t height) {
  const size_t row = 3 * (size_t)width + 1, size = row * height;
  uint8_t *raw = (uint8_t *)allocate(size, 1), head[13] = {0};
  png_bits to = {(uint8_t *)allocate(2 * size + 64, 1), 0, 0, 0};
  uint32_t a = 1, b = 0;
  for (uint32_t y = 0; y < height; y++) {
    const uint8_t *from = rgb + (size_t)(height - 1 - y) * (row - 1);
    raw[y * row] = 2; /* the filter "up" */
    for (size_t x = 0; x + 1 < row; x++) raw[y * row + 1 + x] = (uint8_t)(from[x] - (y > 0 ? from[x + row - 1] : 0));
  }
  for (size_t i = 0; i < size; i++) {
    a = (a + raw[i]) % 65521;
    b = (b + a) % 65521;
  }
  png_put(&to, 0x0178, 16); /* the head of zlib: 32 KB window */
  png_put(&to, 3, 3);       /* one last block in fixed codes */
  for (size_t i = 0; i < size;) {
    size_t run = 0;
    if (i > 0)
      while (run < 258 && i + run < size && raw[i + run] == raw[i - 1]) run++;
    if (run == 258) {
      png_code(&to, 285);
      png_put(&to, 0, 5); /* distance 1 */
    } else if (run >= 3 && run <= 10) {
      png_code(&to, 254 + (uint32_t)run);
      png_put(&to, 0, 5);
    } else if (run > 10) {
      run = 10;
      png_code(&to, 264);
      png_put(&to, 0, 5);
    } else {
      run = 1;
      png_code(&to, raw[i]);
    }
    i += run;
  }
  png_code(&to, 256);
  png_put(&to, 0, 7);
  put_number(to.bytes + to.count, b << 16 | a);
  FILE *out = create_file(directory, name);
  fwrite("\x89PNG\r\n\x1a\n", 1, 8, out);
  put_number(head, width);
  put_number(head + 4, height);
  head[8] = 8; /* bits per channel */
  head[9] = 2; /* RGB */
  put_chunk(out, "IHDR", NULL, head, sizeof head);
  put_chunk(out, "IDAT", NULL, to.bytes, (uint32_t)to.count + 4);
  put_chunk(out, "IEND", NULL, NULL, 0);
  if (fclose(out) != 0) fail("cannot write", name);
  free(raw);
  free(to.bytes);
}

#endif

/* Curves over time as a picture: a PNG without compression, which needs no library. C99. */
#ifndef SINEW_CHART_H
#define SINEW_CHART_H

#include "example.h"

#define CHART_WIDTH 960
#define CHART_HEIGHT 360

typedef struct chart {
  unsigned char pixels[CHART_HEIGHT][CHART_WIDTH][3];
} chart;

typedef struct colour { unsigned char parts[3]; } colour;

static inline void dot(chart *drawn, int x, int y, colour ink) {
  if (x >= 0 && x < CHART_WIDTH && y >= 0 && y < CHART_HEIGHT) memcpy(drawn->pixels[y][x], ink.parts, 3);
}

/* An empty chart with a line for every whole unit of both axes. */
static inline chart *new_chart(double width, double height) {
  chart *drawn = (chart *)allocate(1, sizeof *drawn);
  const colour grey = {{215, 215, 215}};
  double at;
  int i;
  memset(drawn->pixels, 255, sizeof drawn->pixels);
  for (at = 0; at <= width; at += 1) {
    for (i = 0; i < CHART_HEIGHT; i++) dot(drawn, (int)(at / width * (CHART_WIDTH - 1)), i, grey);
  }
  for (at = 0; at <= height; at += 1) {
    for (i = 0; i < CHART_WIDTH; i++) dot(drawn, i, (int)((1 - at / height) * (CHART_HEIGHT - 1)), grey);
  }
  return drawn;
}

/* A curve of values that are evenly spaced over the whole width; `height` is at the top, 0 at the bottom. */
static inline void draw_curve(chart *drawn, const float *values, size_t count, double height, colour ink) {
  int x, last = -1;
  for (x = 0; x < CHART_WIDTH; x++) {
    const float value = values[(size_t)((double)x / (CHART_WIDTH - 1) * (double)(count - 1))];
    int y = (int)((1 - value / height) * (CHART_HEIGHT - 2)), from;
    y = y < 0 ? 0 : y > CHART_HEIGHT - 1 ? CHART_HEIGHT - 1 : y;
    for (from = last < 0 ? y : last; from != y; from += from < y ? 1 : -1) dot(drawn, x, from, ink);
    dot(drawn, x, y, ink);
    dot(drawn, x, y + 1, ink);
    last = y;
  }
}

static inline uint32_t crc_of(uint32_t crc, const unsigned char *bytes, size_t count) {
  size_t i;
  int bit;
  for (i = 0; i < count; i++) {
    crc ^= bytes[i];
    for (bit = 0; bit < 8; bit++) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
  }
  return crc;
}

static inline void put_number(unsigned char *place, uint32_t number) {
  int i;
  for (i = 0; i < 4; i++) place[i] = (unsigned char)(number >> (24 - 8 * i));
}

static inline void write_chunk(FILE *file, const char *name, const unsigned char *bytes, size_t count) {
  unsigned char number[4];
  uint32_t crc = crc_of(0xffffffffu, (const unsigned char *)name, 4);
  put_number(number, (uint32_t)count);
  fwrite(number, 1, 4, file);
  fwrite(name, 1, 4, file);
  fwrite(bytes, 1, count, file);
  put_number(number, ~crc_of(crc, bytes, count));
  fwrite(number, 1, 4, file);
}

/* Writes a chart to directory/name and frees it. */
static inline void save_chart(chart *drawn, const char *directory, const char *name) {
  static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  const size_t row = 1 + 3 * CHART_WIDTH, block = 5 + row;
  unsigned char header[13] = {0}, *data = (unsigned char *)allocate(2 + CHART_HEIGHT * block + 4, 1), *next = data + 2;
  uint32_t a = 1, b = 0; /* Adler's sums */
  FILE *file = create_file(directory, name);
  size_t i, y;
  put_number(header, CHART_WIDTH), put_number(header + 4, CHART_HEIGHT);
  header[8] = 8, header[9] = 2; /* eight bits, red green blue */
  data[0] = 0x78, data[1] = 0x01;
  for (y = 0; y < CHART_HEIGHT; y++, next += block) { /* a stored block for each row, which begins with its filter: none */
    next[0] = y + 1 == CHART_HEIGHT;
    next[1] = (unsigned char)(row & 0xff), next[2] = (unsigned char)(row >> 8);
    next[3] = (unsigned char)~next[1], next[4] = (unsigned char)~next[2];
    memcpy(next + 6, drawn->pixels[y], 3 * CHART_WIDTH);
    for (i = 5; i < block; i++) a = (a + next[i]) % 65521, b = (b + a) % 65521;
  }
  put_number(next, b << 16 | a);
  fwrite(signature, 1, 8, file);
  write_chunk(file, "IHDR", header, 13);
  write_chunk(file, "IDAT", data, 2 + CHART_HEIGHT * block + 4);
  write_chunk(file, "IEND", data, 0);
  if (ferror(file) != 0 || fclose(file) != 0) fail("cannot write", name);
  free(data);
  free(drawn);
}

#endif

/* Joins PNG files of equal size, as the library writes them, to one animated PNG. */
#ifndef SINEW_APNG_H
#define SINEW_APNG_H
#include "example.h"

static inline void put_number(uint8_t *bytes, uint32_t value) {
  for (int i = 0; i < 4; i++) bytes[i] = (uint8_t)(value >> (24 - 8 * i));
}

static inline uint32_t get_number(const uint8_t *bytes) {
  return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

/* The checksum of PNG, continued from the checksum of earlier bytes; 0 to begin. */
static inline uint32_t checksum(uint32_t sum, const uint8_t *bytes, size_t count) {
  sum = ~sum;
  for (size_t i = 0; i < count; i++) {
    sum ^= bytes[i];
    for (int bit = 0; bit < 8; bit++) sum = sum >> 1 ^ (0xEDB88320u & (0u - (sum & 1u)));
  }
  return ~sum;
}

/* Writes a chunk; `type` holds 4 letters. `sequence` is nullable: a number written before the data, then increased. */
static inline void put_chunk(FILE *file, const char *type, uint32_t *sequence, const uint8_t *data, uint32_t size) {
  uint8_t head[12], tail[4];
  const uint32_t extra = sequence == NULL ? 0 : 4;
  put_number(head, size + extra);
  memcpy(head + 4, type, 4);
  if (sequence != NULL) put_number(head + 8, (*sequence)++);
  put_number(tail, checksum(checksum(0, head + 4, 4 + extra), data, size));
  fwrite(head, 1, 8 + extra, file);
  if (size > 0) fwrite(data, 1, size, file);
  fwrite(tail, 1, 4, file);
}

static inline uint8_t *read_file(const char *path, size_t *size) {
  FILE *file = fopen(path, "rb");
  if (file == NULL) fail("cannot read", path);
  fseek(file, 0, SEEK_END);
  *size = (size_t)ftell(file);
  rewind(file);
  uint8_t *bytes = (uint8_t *)allocate(*size + 1, 1);
  if (fread(bytes, 1, *size, file) != *size) fail("cannot read", path);
  fclose(file);
  return bytes;
}

/* Joins directory/name_000.png and its successors to directory/name.png. The delay of a frame is in milliseconds. */
static inline void join_frames(const char *directory, const char *name, uint32_t frame_count, uint16_t delay) {
  char file_name[64];
  snprintf(file_name, sizeof file_name, "%s.png", name);
  FILE *out = create_file(directory, file_name);
  uint32_t sequence = 0;
  for (uint32_t frame = 0; frame < frame_count; frame++) {
    snprintf(file_name, sizeof file_name, "%s_%03u.png", name, (unsigned)frame);
    char *path = path_in(directory, file_name);
    size_t size;
    uint8_t *png = read_file(path, &size);
    int is_begun = 0;
    if (frame == 0) fwrite(png, 1, 8, out); /* the signature */
    for (size_t at = 8; at + 12 <= size; at += 12 + get_number(png + at)) {
      const uint32_t length = get_number(png + at);
      const char *type = (const char *)png + at + 4;
      if (memcmp(type, "IHDR", 4) == 0 && frame == 0) {
        uint8_t animation[8];
        put_chunk(out, "IHDR", NULL, png + at + 8, length);
        put_number(animation, frame_count);
        put_number(animation + 4, 0); /* repeat forever */
        put_chunk(out, "acTL", NULL, animation, 8);
      } else if (memcmp(type, "IDAT", 4) == 0) {
        if (!is_begun) { /* width, height, offsets 0, delay in 1/1000 s, replace all pixels */
          uint8_t control[22] = {0};
          memcpy(control, png + 16, 8);
          control[16] = (uint8_t)(delay >> 8);
          control[17] = (uint8_t)delay;
          control[18] = 1000 >> 8;
          control[19] = 1000 & 255;
          put_chunk(out, "fcTL", &sequence, control, sizeof control);
          is_begun = 1;
        }
        put_chunk(out, frame == 0 ? "IDAT" : "fdAT", frame == 0 ? NULL : &sequence, png + at + 8, length);
      }
    }
    free(png);
    remove(path);
    free(path);
  }
  put_chunk(out, "IEND", NULL, NULL, 0);
  fclose(out);
}

#endif

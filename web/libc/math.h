/* What the samples take from C's mathematics; Rust's library for WebAssembly has it under the same names. */
#ifndef SINEW_WEB_MATH_H
#define SINEW_WEB_MATH_H

float copysignf(float size, float sign);
double cos(double angle);
float cosf(float angle);
double fabs(double value);
float fabsf(float value);
float fminf(float a, float b);
float fmaxf(float a, float b);
float sinf(float angle);
double sqrt(double value);
float sqrtf(float value);

#endif

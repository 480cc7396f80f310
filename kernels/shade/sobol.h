// SPDX-License-Identifier: MIT
// The first two Sobol dimensions and their scrambles, of a number or of lanes of numbers (T: 32 bits each,
// arithmetic wraps around). Laine & Karras 2011; Burley 2020, "Practical hash-based Owen scrambling".
#pragma once

namespace firn::kernels {

template <class T>
__attribute__((always_inline)) constexpr T reverse_bits(T x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0xff00ff00u) >> 8) | ((x & 0x00ff00ffu) << 8);
  x = ((x & 0xf0f0f0f0u) >> 4) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x & 0xccccccccu) >> 2) | ((x & 0x33333333u) << 2);
  return ((x & 0xaaaaaaaau) >> 1) | ((x & 0x55555555u) << 1);
}

// A random binary tree of swaps, applied to the digits of x from its last bit on: an Owen scramble keeps
// every dyadic stratum.
template <class T>
__attribute__((always_inline)) constexpr T scramble_reversed(T x, T seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

// Second Sobol dimension, bits reversed: digit j is the sum modulo 2 of the index's bits i with C(i, j) odd,
// that is i a superset of j. The first, reversed, is the index itself.
template <class T>
__attribute__((always_inline)) constexpr T sobol_second_reversed(T index) {
  index ^= (index >> 1) & 0x55555555u;
  index ^= (index >> 2) & 0x33333333u;
  index ^= (index >> 4) & 0x0f0f0f0fu;
  index ^= (index >> 8) & 0x00ff00ffu;
  index ^= index >> 16;
  return index;
}

}  // namespace firn::kernels

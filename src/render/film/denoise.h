// SPDX-License-Identifier: MIT
// Takes the noise out of a picture without taking its detail. The light on a surface (the picture without its
// albedo) at a pixel becomes the value there of a plane over the normals, fitted to the pixels about it that
// look alike (first-order regression: Bitterli et al. 2016, "Nonlinearly weighted first-order regression for
// denoising Monte Carlo renderings"). How alike two pixels are is told by the patches about them, measured
// against their variance (non-local means: Rousselle et al. 2012, 2013), and by albedo, normal and depth. The
// albedo loses its own noise the same way, by plain means, and is multiplied back.
#pragma once
#include <vector>

namespace firn {

// What is known of each pixel, width x height, row by row.
struct NoisyPicture {
  int width = 0, height = 0;
  std::vector<float> rgb;              // 3 a pixel
  std::vector<float> variance;         // of the pixel's luminance
  std::vector<float> albedo;           // 3 a pixel, mean over it; 1 where there is nothing
  std::vector<float> albedo_variance;  // of its luminance
  std::vector<float> normal;           // 3 a pixel, mean over it, of those that light falls on
  std::vector<float> depth;            // m; infinite: nothing there
};

// The picture with less noise, 3 values a pixel. The same bits for any number of threads.
std::vector<float> denoise(const NoisyPicture& noisy);

}  // namespace firn

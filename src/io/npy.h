// SPDX-License-Identifier: MIT
// Arrays of NumPy: one in a .npy file, several in a .npz, which is a ZIP archive of such files.
#pragma once
#include <string>
#include <string_view>

#include "src/geometry/point_cloud.h"

namespace firn {

// `where` names the file in errors: io Error for what is damaged, lacks positions, or has arrays of other
// shapes than these. Of N points: position (N, 3); and, where they are there, velocity (N, 3), F (N, 3, 3),
// and volume, mass, radius, density and Jp (N), (N, 1), or one number for all. Other arrays are passed over.
PointCloud decode_npz(std::string_view archive, const std::string& where);
PointCloud decode_npy(std::string_view array, const std::string& where);  // the positions alone

// An archive from which decode_npz() makes the very same cloud: float64, but for F, which is float32.
std::string encode_npz(const PointCloud& cloud);

}  // namespace firn

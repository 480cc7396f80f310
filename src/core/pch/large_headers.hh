// SPDX-License-Identifier: MIT
// Precompiled for speed alone: the large headers that most of src/, tests/ and bench/ include. Every file
// still includes what it uses; builds with -Db_pch=false (`.ci/full gcc`, `.ci/full clang`) find what one
// forgot.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "src/core/parallel.h"
#include "src/core/vector.h"

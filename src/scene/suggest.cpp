// SPDX-License-Identifier: MIT
#include "src/scene/suggest.h"

#include <algorithm>

namespace firn {

int edit_distance(const std::string& a, const std::string& b) {
  const int n = static_cast<int>(a.size()), m = static_cast<int>(b.size());
  std::vector<std::vector<int>> d(n + 1, std::vector<int>(m + 1));
  for (int i = 0; i <= n; ++i) d[i][0] = i;
  for (int j = 0; j <= m; ++j) d[0][j] = j;
  for (int i = 1; i <= n; ++i) {
    for (int j = 1; j <= m; ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[n][m];
}

std::string suggestion(const std::string& word, const std::vector<std::string>& names) {
  const std::string* best = nullptr;
  int least =
      static_cast<int>(word.size()) / 3 + 2;  // one error more than a third of the letters is another word
  for (const std::string& name : names) {
    const int distance = edit_distance(word, name);
    if (distance < least && distance < static_cast<int>(name.size())) {
      least = distance;
      best = &name;
    }
  }
  return best ? ", did you mean '" + *best + "'?" : "";
}

}  // namespace firn

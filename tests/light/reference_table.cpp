// SPDX-License-Identifier: MIT
#include "tests/light/reference_table.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace firn::test {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> words;
  std::istringstream in(line);
  for (std::string word; std::getline(in, word, ',');) words.push_back(word);
  return words;
}

}  // namespace

std::vector<std::map<std::string, std::string>> reference_table(const std::string& name) {
  std::ifstream file(FIRN_SOURCE_ROOT "/tests/light/reference/" + name + ".csv");
  std::string line;
  if (!std::getline(file, line)) throw std::runtime_error("no reference table " + name);
  const std::vector<std::string> names = split(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(file, line)) {
    const std::vector<std::string> words = split(line);
    if (words.size() != names.size()) throw std::runtime_error(name + ".csv: " + line);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (i == 0) rows.emplace_back();
      rows.back()[names[i]] = words[i];
    }
  }
  return rows;
}

}  // namespace firn::test

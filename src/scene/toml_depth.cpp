// SPDX-License-Identifier: MIT
// In: TOML text, right or wrong. Out: a place that is too deep. Strings and comments are passed over; all
// else is read only for its points, brackets, commas and ends of lines.
#include "src/scene/toml_depth.h"

#include <algorithm>
#include <vector>

namespace firn {
namespace {

class DepthScan {
 public:
  DepthScan(std::string_view text, int most) : text_(text), most_(most) {}

  std::optional<TextPlace> run() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"' || c == '\'') {
        pass_string(c);
      } else if (c == '#') {
        pass_comment();
      } else {
        follow(c);
        if (level_ > most_) return TextPlace{line_, column_};
        step();
      }
    }
    return std::nullopt;
  }

 private:
  void step() {
    const char c = text_[at_++];
    if (c == '\n') {
      ++line_;
      column_ = 1;
    } else if ((static_cast<unsigned char>(c) & 0xC0) != 0x80) {
      ++column_;
    }
  }

  bool starts(std::string_view word) const { return text_.substr(at_, word.size()) == word; }

  void pass_comment() {
    while (at_ < text_.size() && text_[at_] != '\n') step();
  }

  // To the end of a string, or of the line where one is not closed: the parser will say so.
  void pass_string(char quote) {
    const std::string_view three = quote == '"' ? R"(""")" : "'''";
    const bool long_form = starts(three);
    const std::string_view close = long_form ? three : three.substr(0, 1);
    for (std::size_t i = 0; i < close.size(); ++i) step();
    while (at_ < text_.size() && !starts(close)) {
      if (!long_form && text_[at_] == '\n') return;
      if (quote == '"' && text_[at_] == '\\' && at_ + 1 < text_.size()) step();
      step();
    }
    for (std::size_t i = 0; i < close.size() && at_ < text_.size(); ++i) step();
    // A long string may end in one or two quotes of its own.
    for (int i = 0; long_form && i < 2 && at_ < text_.size() && text_[at_] == quote; ++i) step();
  }

  void follow(char c) {
    if (c == '.') ++level_;
    if (c == '[' || c == '{') open(c);
    if ((c == ']' || c == '}') && !before_.empty()) {
      if (in_header_) table_ = std::max(table_, level_);
      level_ = before_.back();
      before_.pop_back();
    }
    if (c == ',') level_ = before_.empty() ? table_ : before_.back() + 1;
    if (c == '\n' && before_.empty()) {
      level_ = table_;
      fresh_line_ = true;
      in_header_ = false;
    }
    if (c != ' ' && c != '\t' && c != '\n' && c != '\r') fresh_line_ = false;
  }

  void open(char c) {
    if (fresh_line_ && before_.empty() && c == '[') {
      in_header_ = true;
      level_ = table_ = 0;
    }
    before_.push_back(level_);
    ++level_;
  }

  const std::string_view text_;
  const int most_;
  std::size_t at_ = 0;
  int line_ = 1, column_ = 1;
  int level_ = 0;            // here
  int table_ = 0;            // of the last [header]
  std::vector<int> before_;  // the open brackets, and the level before each
  bool fresh_line_ = true;   // nothing but white space in it yet
  bool in_header_ = false;
};

}  // namespace

std::optional<TextPlace> find_deep_nesting(std::string_view text, int most) {
  return DepthScan(text, most).run();
}

}  // namespace firn

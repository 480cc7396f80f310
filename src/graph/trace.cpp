// SPDX-License-Identifier: MIT
// The format is "JSON object format" of the Trace Event specification: rows are named by metadata events,
// then follows one complete event an interval.
#include "src/graph/trace.h"

#include <cstdio>
#include <string_view>

namespace firn {
namespace {

constexpr const char* kRows[] = {"simulate", "trace", "write"};

int row_of(std::string_view stage) {
  int row = 0;
  while (row < 3 && stage != kRows[row]) ++row;
  return row;
}

template <class... Values>
std::string line(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace

std::string chrome_trace(const std::vector<StageInterval>& intervals) {
  std::string json = "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n";
  for (int row = 0; row < 3; ++row) {
    json += line("{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":%d,\"args\":{\"name\":\"%s\"}},\n",
                 row, kRows[row]);
  }
  for (const auto& i : intervals) {
    json += line(
        "{\"name\":\"%s %d\",\"cat\":\"%s\",\"ph\":\"X\",\"pid\":1,\"tid\":%d,\"ts\":%.1f,\"dur\":%.1f,"
        "\"args\":{\"frame\":%d,\"thread\":%d}},\n",
        i.stage, i.frame, i.stage, row_of(i.stage), 1e6 * i.begin, 1e6 * (i.end - i.begin), i.frame,
        i.thread);
  }
  json += "{\"name\":\"process_name\",\"ph\":\"M\",\"pid\":1,\"args\":{\"name\":\"firn\"}}\n]}\n";
  return json;
}

}  // namespace firn

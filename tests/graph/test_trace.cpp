// SPDX-License-Identifier: MIT
#include "src/graph/trace.h"
#include "tests/catch.h"

using namespace firn;

TEST_CASE("The Chrome trace holds one complete event an interval, in microseconds, one row a stage") {
  const std::string json = chrome_trace({{"simulate", 7, 0.5, 0.75, 1}, {"write", 6, 0.6, 0.601, 0}});
  CHECK(json.find(
            "{\"name\":\"simulate 7\",\"cat\":\"simulate\",\"ph\":\"X\",\"pid\":1,\"tid\":0,\"ts\":500000.0,"
            "\"dur\":250000.0,\"args\":{\"frame\":7,\"thread\":1}}") != std::string::npos);
  CHECK(json.find("\"tid\":2,\"ts\":600000.0,\"dur\":1000.0") != std::string::npos);
  CHECK(json.find(",\n]") == std::string::npos);
}

// SPDX-License-Identifier: MIT
// TOML that nests too deep is refused before the parser, which follows it by recursion, sees it.
#include <string>

#include "src/scene/toml_depth.h"
#include "src/scene/toml_text.h"
#include "tests/catch.h"
#include "tests/scene/read_text.h"
#include "tests/scene/refuses.h"

namespace firn::test::depth {
namespace {

const std::string kKey = "a", kValue = "a = ";

std::string repeat(const std::string& text, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

bool deep(const std::string& text) { return find_deep_nesting(text, 8).has_value(); }

}  // namespace

TEST_CASE("parts of keys, of tables and brackets all count as levels, alone and together") {
  for (const int levels : {20'000, 1'000'000}) {
    for (const std::string& text :
         {kKey + repeat(".a", levels) + " = 1", "[" + kKey + repeat(".a", levels) + "]\n",
          "[[" + kKey + repeat(". a", levels) + "]]", std::string("\"a\"") + repeat(".'a'", levels) + " = 1",
          kValue + repeat("[", levels), kValue + repeat("{a = ", levels),
          kValue + repeat("{a.a.a = ", levels), kValue + "[\n" + repeat("[ # [\n", levels)}) {
      INFO(text.substr(0, 20));
      CHECK(deep(text));
      CHECK_REFUSES(read(text), "levels");
    }
  }
  CHECK(deep("[a.b.c]\nd.e.f = {g.h = {i.j = 1}}"));
  CHECK(deep("a = {b = \"\"\"c\"\"\"\"\", d.e.f.g.h.i.j.k.l = 1}"));
  CHECK(deep("a = 'b' # c\n[d.e.f.g]\nh.i.j.k.l.m = 1"));
}

TEST_CASE("what is beside one another is not deep, and neither is what stands in strings and comments") {
  CHECK_FALSE(deep(repeat("a.b.c = 1.5\n", 1000)));
  CHECK_FALSE(deep(kValue + "[" + repeat("1.5, ", 1000) + "]"));
  CHECK_FALSE(deep(kValue + "[" + repeat("[1.5, 2.5], {b.c = 1.5},", 1000) + "]"));
  CHECK_FALSE(deep(repeat("[a.b.c]\n", 1000)));
  CHECK_FALSE(deep(repeat("[[a.b]]\nc.d = 1\n", 1000)));
  CHECK_FALSE(deep(kValue + "\"" + repeat("[", 100) + "\\\"" + repeat(".", 100) + "\""));
  CHECK_FALSE(deep(kValue + "'''" + repeat("[\n'", 100) + "'''"));
  CHECK_FALSE(deep(kValue + "'" + repeat(".", 100) + "' # " + repeat("[", 100)));
  CHECK_FALSE(deep(kValue + "\"\"\"\n" + repeat("{.", 100) + "\\\"\"\"\" b\"\"\""));
  CHECK_FALSE(deep(std::string("'") + repeat(".", 100)));
}

TEST_CASE("the place of the depth is where the last level begins") {
  const auto place = find_deep_nesting("# first\n\xC3\xA4.b.c.d = 1", 2);
  REQUIRE(place);
  CHECK(place->line == 2);
  CHECK(place->column == 6);
  CHECK_REFUSES(read(kKey + repeat(".a", 100) + " = 1"), "scene.toml:1:");
}

}  // namespace firn::test::depth

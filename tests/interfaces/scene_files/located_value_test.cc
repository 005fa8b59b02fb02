// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/located_value.h"

#include <gmock/gmock.h>

#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using testing::AllOf;
using testing::HasSubstr;
using Kind = LocatedValue::Kind;

core::Status status_of(const std::string& text, const YamlLimits& limits = {}) {
  return parse_yaml(text, "f.yaml", limits).status();
}

TEST(ParseYaml, KeepsLineColumnAndPathOfEveryValue) {
  const auto tree = parse_yaml("a: 1\nb:\n  c: [x, \"7\"]\n  d: ~\n", "f.yaml");
  ASSERT_TRUE(tree.ok());
  ASSERT_EQ(tree->keys.size(), 2U);
  EXPECT_EQ(tree->find("a")->text, "1");
  const LocatedValue& b = *tree->find("b");
  const LocatedValue& c = *b.find("c");
  EXPECT_EQ(b.keys[0].place.line, 3);
  EXPECT_EQ(b.keys[0].place.column, 3);
  EXPECT_EQ(c.path, "b.c");
  EXPECT_EQ(c.items[1].path, "b.c[1]");
  EXPECT_EQ(c.items[1].place.line, 3);
  EXPECT_EQ(c.items[1].place.column, 10);
  EXPECT_FALSE(c.items[0].quoted);
  EXPECT_TRUE(c.items[1].quoted);
  EXPECT_EQ(b.find("d")->kind, Kind::kNothing);
  EXPECT_EQ(*c.place.file, "f.yaml");
  EXPECT_EQ(tree->find("zzz"), nullptr);
}

TEST(ParseYaml, ExpandsAliases) {
  const auto tree = parse_yaml("a: &x {p: 1}\nb: *x\n", "f.yaml");
  ASSERT_TRUE(tree.ok());
  EXPECT_EQ(tree->find("b")->find("p")->text, "1");
  EXPECT_EQ(tree->find("b")->find("p")->path, "b.p");
}

TEST(ParseYaml, NamesTheLineOfAMistakeInYaml) {
  EXPECT_THAT(status_of("a: 1\nb: [1, 2\nc: 3\n").message(), HasSubstr("f.yaml:"));
  EXPECT_THAT(status_of("a: 1\n\tb: 2\n").message(), HasSubstr("f.yaml:2"));
  EXPECT_THAT(status_of("a: 1\nb: 2\na: 3\n").message(),
              HasSubstr("f.yaml:3: the key 'a' is here twice, first on line 1"));
  EXPECT_THAT(status_of("? [1, 2]\n: 3\n").message(), HasSubstr("a key is not a word"));
  EXPECT_THAT(status_of("a: 1\n---\nb: 2\n").message(), HasSubstr("second document"));
  EXPECT_THAT(status_of("").message(), HasSubstr("empty"));
  EXPECT_THAT(status_of("# nothing\n").message(), HasSubstr("empty"));
  EXPECT_THAT(status_of("a: *b\n").message(), HasSubstr("f.yaml:1"));
  EXPECT_THAT(status_of("a: &b [1, *b]\n").message(), HasSubstr("not complete"));
}

TEST(ParseYaml, NamesTheLineThatLacksSomethingAndNotTheNext) {
  EXPECT_THAT(status_of("a: 1\nb: {c: 2, d: 3\ne: 4\n").message(),
              AllOf(HasSubstr("f.yaml:2: "), HasSubstr("close the bracket")));
  EXPECT_THAT(status_of("a: 1\nb: [1, 2  # some\n\n# of it\ne: 4\n").message(),
              AllOf(HasSubstr("f.yaml:2: "), HasSubstr("close the bracket")));
  EXPECT_THAT(status_of("a: 1\ngravity 9\nb: 2\n").message(), AllOf(HasSubstr("f.yaml:2: "), HasSubstr("write ':'")));
  EXPECT_THAT(status_of("a: 1\nb: c: d\n").message(), HasSubstr("f.yaml:2: "));
}

TEST(ParseYaml, CollectsKeysThatAreGivenTwice) {
  Problems problems;
  const auto tree = parse_yaml("a: 1\nb: {c: 2, c: [3, {d: 4}]}\na: {e: 5}\nf: 6\n", "f.yaml", {}, &problems);
  ASSERT_TRUE(tree.ok());
  ASSERT_EQ(problems.errors().size(), 2u);
  EXPECT_EQ(problems.errors()[0].line, 2);
  EXPECT_EQ(problems.errors()[1].line, 3);
  ASSERT_EQ(tree->keys.size(), 3u);
  ASSERT_EQ(tree->items.size(), 3u);
  EXPECT_EQ(tree->find("a")->text, "1");  // the first counts
  EXPECT_EQ(tree->find("b")->find("c")->text, "2");
  EXPECT_EQ(tree->find("f")->text, "6");
  Problems both;
  const core::Status failed = parse_yaml("a: 1\na: 2\nb: [1\n", "f.yaml", {}, &both).status();
  EXPECT_EQ(both.errors().size(), 2u);
  EXPECT_THAT(failed.message(), AllOf(HasSubstr("f.yaml:2: the key 'a'"), HasSubstr("f.yaml:3: this is not YAML")));
}

TEST(ParseYaml, StopsBombs) {
  std::string laughs = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    std::string list = before;
    for (int k = 0; k < 9; ++k) list.append(", ").append(before);
    const std::string name = "a" + std::to_string(i);
    laughs.append(name).append(": &").append(name).append(" [").append(list).append("]\n");
  }
  EXPECT_EQ(status_of(laughs).code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(status_of(laughs).message(), HasSubstr("aliases"));
  // Anchors within anchors are copied, too.
  std::string nested;
  for (int i = 0; i < 40; ++i) nested.append("&a").append(std::to_string(i)).append(" [");
  nested.append(20000, ' ');
  for (int i = 0; i < 20000; ++i) nested.append("1,");
  nested.append(40, ']');
  EXPECT_EQ(status_of(nested).code(), StatusCode::kResourceExhausted);
}

TEST(ParseYaml, StopsDepthSizeAndTooManyKeys) {
  EXPECT_EQ(status_of(std::string(100, '[') + std::string(100, ']')).code(), StatusCode::kResourceExhausted);
  EXPECT_FALSE(status_of(std::string(100000, '[')).ok());
  EXPECT_FALSE(status_of(std::string(100000, '{')).ok());
  std::string dashes;
  for (int i = 0; i < 50000; ++i) dashes += "- ";
  EXPECT_FALSE(status_of(dashes).ok());
  YamlLimits small;
  small.max_bytes = 10;
  EXPECT_EQ(status_of("a: 0123456789", small).code(), StatusCode::kResourceExhausted);
  YamlLimits few;
  few.max_values = 5;
  EXPECT_EQ(status_of("[1, 2, 3, 4, 5, 6]", few).code(), StatusCode::kResourceExhausted);
  EXPECT_TRUE(status_of("[1, 2, 3]", few).ok());
  std::string keys;
  for (int i = 0; i < 2000; ++i) keys += "k" + std::to_string(i) + ": 1\n";
  EXPECT_EQ(status_of(keys).code(), StatusCode::kResourceExhausted);
  // An alias puts its copy deeper than it was written.
  std::string deep = "a: &a " + std::string(30, '[') + std::string(30, ']') + "\nb: " + std::string(30, '[') + "*a" +
                     std::string(30, ']');
  EXPECT_EQ(status_of(deep).code(), StatusCode::kResourceExhausted);
}

TEST(ParseYaml, DoesNotPrintWhatCouldHarmATerminal) {
  const auto status = status_of("\"\\e[31mred\": 1\n\"\\e[31mred\": 2\n");
  EXPECT_EQ(status.message().find('\x1b'), std::string::npos);
}

TEST(ParseYaml, RefusesWhatIsNotUtf8AndNamesTheLine) {
  EXPECT_THAT(status_of("name: a\noutcome: \"\xff\"\n").message(), testing::HasSubstr("(line 2) is not UTF-8"));
  EXPECT_TRUE(parse_yaml("name: \"\xc3\xbc\"\n", "f.yaml", {}).ok());
  const std::string wide(
      "\xff\xfe"
      "a\0:\0 \0"
      "1\0\n\0",
      12);  // UTF-16 is YAML too
  EXPECT_TRUE(parse_yaml(wide, "f.yaml", {}).ok());
}

TEST(ReadYaml, SaysWhatIsWrongWithTheFile) {
  const tests::ScratchDir folder;
  EXPECT_EQ(read_yaml(folder.path() / "none.yaml").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(read_yaml(folder.path()).status().code(), StatusCode::kInvalidInput);
}

}  // namespace
}  // namespace prescene::interfaces

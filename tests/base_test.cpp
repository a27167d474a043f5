#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "base/parallel.h"
#include "base/random.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

JsonFile FileWith(const TemporaryFolder& folder, const std::string& text) {
  WriteTextFile(folder.path / "a.json", text);
  return JsonFile(folder.path / "a.json");
}

std::string ComplaintAbout(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(Json, CommentsAreAllowedAndStringsKeepTheirSlashes) {
  const TemporaryFolder folder;
  const JsonFile file = FileWith(folder, "{\"a\": 1, // one\n \"b\": \"x//y\"}");
  const JsonObject root(file.root(), {"a", "b"});
  EXPECT_EQ(root.Require("a").Number(), 1.0);
  EXPECT_EQ(root.Require("b").String(), "x//y");
}

TEST(Json, AnUnknownKeyNamesFileKeyAndTheNearestKnownOne) {
  const TemporaryFolder folder;
  const JsonFile file = FileWith(folder, "{\"o\": {\"exposre\": 1}}");
  const std::string text = ComplaintAbout([&] {
    JsonObject(JsonObject(file.root(), {"o"}).Require("o"), {"exposure", "mask"});
  });
  EXPECT_NE(text.find("a.json"), std::string::npos);
  EXPECT_NE(text.find("o.exposre"), std::string::npos);
  EXPECT_NE(text.find("Did you mean 'exposure'"), std::string::npos);
}

TEST(Json, MistypedMissingDoubledDeepAndHugeValuesAreRefusedByName) {
  const TemporaryFolder folder;
  const JsonFile file = FileWith(folder, "{\"a\": \"one\"}");
  const JsonObject root(file.root(), {"a", "b"});
  EXPECT_NE(ComplaintAbout([&] { root.Require("a").Number(); }).find("a: expected a number, found a text"),
            std::string::npos);
  EXPECT_NE(ComplaintAbout([&] { root.Require("b"); }).find("b: this required key is missing"), std::string::npos);
  EXPECT_NE(ComplaintAbout([&] { FileWith(folder, "{\"a\": 1, \"a\": 2}"); }).find("twice"), std::string::npos);
  EXPECT_NE(ComplaintAbout([&] { FileWith(folder, std::string(100000, '[')); }).find("nested"), std::string::npos);
  EXPECT_NE(ComplaintAbout([&] { FileWith(folder, "{\"a\": 1e999}"); }).find("a.json"), std::string::npos);
}

TEST(Json, NumbersSurviveTextExactly) {
  const TemporaryFolder folder;
  for (double v : {0.1, 1.0 / 3.0, 1e-300, -12345.678901234567, 5.0}) {
    const JsonFile file = FileWith(folder, ToJsonText(JsonValue::Object{{"v", v}}));
    EXPECT_EQ(JsonObject(file.root(), {"v"}).Require("v").Number(), v);
  }
}

TEST(Files, NothingHalfWrittenStandsUnderTheFinalName) {
  const TemporaryFolder folder;
  const auto file = folder.path / "deep" / "result.txt";
  EXPECT_THROW(WriteBesideAndRename(file,
                                    [&](const auto& beside) {
                                      std::ofstream(beside) << "half";
                                      throw std::runtime_error("power cut");
                                    }),
               std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_TRUE(std::filesystem::is_empty(file.parent_path()));
  WriteTextFile(file, "abc");
  EXPECT_EQ(Sha256OfFile(file), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");  // FIPS 180-2, B.1
}

TEST(Random, MeanAndVarianceAreThoseOfTheUnitIntervalAndNeighboursAreIndependent) {
  constexpr int kCount = 100000;
  double sum = 0, squares = 0, products = 0;
  for (int i = 0; i < kCount; ++i) {
    const double a = Uniform(7, i) - 0.5, b = Uniform(7, i + 1) - 0.5;
    sum += a;
    squares += a * a;
    products += a * b;
  }
  const double sigma = 4.0 / std::sqrt(static_cast<double>(kCount));  // 4 standard errors
  EXPECT_NEAR(sum / kCount, 0.0, sigma * std::sqrt(1.0 / 12.0));
  EXPECT_NEAR(squares / kCount, 1.0 / 12.0, sigma * std::sqrt(1.0 / 180.0));
  EXPECT_NEAR(products / kCount, 0.0, sigma / 12.0);
}

TEST(Parallel, EveryItemIsVisitedOnceWhateverTheThreads) {
  for (int threads : {1, 2, 7}) {
    std::vector<int> visits(1000, 0);
    ParallelFor(visits.size(), threads, [&](size_t i) { ++visits[i]; });
    EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), 1000);
  }
  EXPECT_THROW(ParallelFor(100, 2,
                           [](size_t i) {
                             if (i == 70) throw InputError("f", "k", "m");
                           }),
               InputError);
}

}  // namespace
}  // namespace crownfit

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "base/confined.h"
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

TEST(Json, UnknownKeyErrorNamesFileKeyAndNearestKnownKey) {
  const TemporaryFolder folder;
  const JsonFile file = FileWith(folder, "{\"o\": {\"exposre\": 1}}");
  const std::string text = ComplaintAbout([&] {
    JsonObject(JsonObject(file.root(), {"o"}).Require("o"), {"exposure", "mask"});
  });
  EXPECT_NE(text.find("a.json"), std::string::npos);
  EXPECT_NE(text.find("o.exposre"), std::string::npos);
  EXPECT_NE(text.find("Did you mean 'exposure'"), std::string::npos);
}

TEST(Json, Utf16IsRefusedWithItsRemedyAndAByteOrderMarkOfUtf8IsRead) {
  const std::string text = "{\"a\": 1}";
  std::string low_first, high_first;
  for (const char c : text) {
    low_first += std::string{c, '\0'};
    high_first += std::string{'\0', c};
  }
  const TemporaryFolder folder;
  for (const std::string& utf16 : {"\xFF\xFE" + low_first, "\xFE\xFF" + high_first, low_first, high_first}) {
    const std::string said = ComplaintAbout([&] { FileWith(folder, utf16); });
    EXPECT_NE(said.find("it may be UTF-16"), std::string::npos) << said;
    EXPECT_NE(said.find("Save it as UTF-8"), std::string::npos) << said;
  }
  const JsonFile marked = FileWith(folder, "\xEF\xBB\xBF" + text);
  EXPECT_EQ(JsonObject(marked.root(), {"a"}).Require("a").Number(), 1.0);
}

TEST(Json, InvalidValuesAreRefusedByName) {
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

TEST(Json, NumbersRoundTripExactly) {
  const TemporaryFolder folder;
  for (double v : {0.1, 1.0 / 3.0, 1e-300, -12345.678901234567, 5.0}) {
    const JsonFile file = FileWith(folder, ToJsonText(JsonValue::Object{{"v", v}}));
    EXPECT_EQ(JsonObject(file.root(), {"v"}).Require("v").Number(), v);
  }
}

TEST(Json, TooManyKeysLongKeysAndControlCharactersAreRefused) {
  const TemporaryFolder folder;
  std::string many = "{";
  for (int i = 0; i < 20000; ++i) many += "\"k" + std::to_string(i) + "\": 0, ";
  EXPECT_NE(ComplaintAbout([&] { FileWith(folder, many + "\"last\": 0}"); }).find("more than 10000 keys"),
            std::string::npos);
  const std::string long_key = ComplaintAbout([&] { FileWith(folder, "{\"" + std::string(100000, 'k') + "\": 0}"); });
  EXPECT_NE(long_key.find("longer than 200"), std::string::npos);
  EXPECT_LT(long_key.size(), 500u);
  EXPECT_NE(ComplaintAbout([&] { FileWith(folder, "{\"\\u001b[2J\": 0}"); }).find("control character"),
            std::string::npos);
}

TEST(Limits, EnvironmentRaisesLimitsAndInvalidValuesAreRefused) {
  const TemporaryFolder folder;
  const auto file = folder.path / "a.json";
  WriteTextFile(file, "[" + std::string(3000000, ' ') + "]");
  setenv("CROWNFIT_MAX_JSON_MIB", "2.5", 1);
  EXPECT_NE(ComplaintAbout([&] { JsonFile{file}; }).find("CROWNFIT_MAX_JSON_MIB"), std::string::npos);
  setenv("CROWNFIT_MAX_JSON_MIB", "3", 1);
  EXPECT_EQ(ComplaintAbout([&] { JsonFile{file}; }), "");
  for (const char* nonsense : {"", "many", "-1", "nan", "3 MiB", "1e99"}) {
    setenv("CROWNFIT_MAX_JSON_MIB", nonsense, 1);
    EXPECT_NE(ComplaintAbout([&] { JsonFile{file}; }).find("CROWNFIT_MAX_JSON_MIB"), std::string::npos) << nonsense;
  }
  unsetenv("CROWNFIT_MAX_JSON_MIB");
}

TEST(Confined, ChildResultsAndErrorsReachTheParent) {
  SharedMemory memory;
  int beside = 1;
  EXPECT_EQ(RunConfined({},
                        [&] {
                          beside = 2;
                          memory.Resize(3);
                          memory.Bytes()[2] = std::byte{7};
                        }),
            Ending::kDone);
  EXPECT_EQ(beside, 1);
  ASSERT_EQ(memory.Bytes().size(), 3u);
  EXPECT_EQ(memory.Bytes()[2], std::byte{7});
  EXPECT_EQ(ComplaintAbout([] { RunConfined({}, [] { throw InputError("f", "k", "m", "r"); }); }),
            InputError("f", "k", "m", "r").what());
}

TEST(Confined, CrashHangAndMemoryLimitEndOnlyTheChild) {
  EXPECT_EQ(RunConfined({}, [] { std::abort(); }), Ending::kCrashed);
  EXPECT_EQ(RunConfined({}, [] { throw 1; }), Ending::kCrashed);
  EXPECT_EQ(RunConfined({}, [] { std::_Exit(0x7f); }), Ending::kCrashed);
  EXPECT_EQ(RunConfined({.seconds = 1}, [] { pause(); }), Ending::kTookTooLong);  // waits without using time
  SharedMemory first;
  first.Resize(1);
  const std::span<std::byte> was_here = first.Bytes();
  EXPECT_EQ(RunConfined({.seconds = 60},
                        [&] {
                          if (std::exchange(was_here[0], std::byte{1}) == std::byte{0}) pause();  // a lock nobody holds
                        }),
            Ending::kDone)
      << "the work is retried in another child";
  EXPECT_EQ(RunConfined({.seconds = 60, .memory_bytes = 1u << 20},
                        [] {
                          SharedMemory memory;
                          memory.Resize(1u << 28);
                          memory.Bytes();
                        }),
            Ending::kNeededTooMuchMemory);
}

TEST(Files, OnlyRegularFilesAreReadWhole) {
  const TemporaryFolder folder;
  const auto read = [](const std::filesystem::path& file) { return ReadWholeFile(file, 10, "less"); };
  WriteTextFile(folder.path / "ten", "0123456789");
  EXPECT_EQ(read(folder.path / "ten"), "0123456789");
  WriteTextFile(folder.path / "eleven", "0123456789a");
  EXPECT_NE(ComplaintAbout([&] { read(folder.path / "eleven"); }).find("less"), std::string::npos);
  ASSERT_EQ(mkfifo((folder.path / "pipe").c_str(), 0600), 0);
  for (const auto& no_file : {folder.path / "pipe", folder.path / "absent", std::filesystem::path("/dev/zero")})
    EXPECT_NE(ComplaintAbout([&] { read(no_file); }).find("no such file"), std::string::npos) << no_file;
  EXPECT_NE(ComplaintAbout([&] { read(folder.path); }).find("is a folder"), std::string::npos);
}

TEST(Files, AMissingPathOfWindowsGetsTheRemedyOfSlashes) {
  const TemporaryFolder folder;
  const auto complaint = [&](const char* name) {
    return ComplaintAbout([&] { ReadWholeFile(folder.path / name, 10, ""); });
  };
  EXPECT_NE(complaint("scans\\a.ply").find("no such file\n  Write / between folders"), std::string::npos);
  EXPECT_EQ(complaint("a.ply").find("Write /"), std::string::npos);
  WriteTextFile(folder.path / "a\\b", "x");
  EXPECT_EQ(ReadWholeFile(folder.path / "a\\b", 10, ""), "x") << "a backslash is a letter of Linux's names";
}

TEST(Files, FailedWriteLeavesNoPartialFile) {
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

TEST(Random, MeanVarianceAndCorrelationAreThoseOfUniformNumbers) {
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

TEST(Parallel, EveryItemIsVisitedOnceForAnyThreadCount) {
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

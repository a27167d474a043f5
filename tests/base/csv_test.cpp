#include <gtest/gtest.h>

#include "base/csv_file.h"
#include "base/error.h"
#include "base/files.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

using Rows = std::vector<std::vector<std::string>>;

CsvTable TableOf(const std::string& text) {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / "t.csv", text);
  return ReadCsvTable(folder.path / "t.csv", 1e6, "");
}

Rows RowsOf(const std::string& text) {
  Rows rows;
  for (const auto& record : TableOf(text).records) rows.push_back(record.cells);
  return rows;
}

std::string Refusal(const std::string& text) {
  try {
    TableOf(text);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(Csv, ReadsCellsOfRfc4180) {
  EXPECT_EQ(RowsOf("a,b\n\"1,2\",\"say \"\"x\"\"\"\n"), (Rows{{"a", "b"}, {"1,2", "say \"x\""}}));
  EXPECT_EQ(RowsOf("\"two\r\nlines\",b"), (Rows{{"two\nlines", "b"}}));
  EXPECT_EQ(RowsOf("a,,\n"), (Rows{{"a", "", ""}}));
}

TEST(Csv, SemicolonsAndTabsSeparateCells) {
  EXPECT_EQ(RowsOf("\xEF\xBB\xBF"
                   "A3,5;65,4\n\"x;y\";1\n"),
            (Rows{{"A3,5", "65,4"}, {"x;y", "1"}}));
  EXPECT_EQ(RowsOf("a\t b \n1\t\n"), (Rows{{"a", "b"}, {"1", ""}}));
  EXPECT_EQ(RowsOf("\"a;b\",c\n"), (Rows{{"a;b", "c"}}));
}

TEST(Csv, ExcelsFirstLineStatesTheSeparatorAndIsNoRow) {
  EXPECT_EQ(RowsOf("sep=;\r\na;b,c\r\n"), (Rows{{"a", "b,c"}}));
  EXPECT_EQ(RowsOf("\xEF\xBB\xBF\"sep=,\"\na;b,c\n"), (Rows{{"a;b", "c"}}));
  EXPECT_EQ(RowsOf("sep=\t\na\tb,c\n"), (Rows{{"a", "b,c"}}));
  EXPECT_EQ(TableOf("sep=;\na;b\n").records[0].line, 2u);
  EXPECT_NE(Refusal("sep=|\na|b\n").find("line 1: 'sep=|'"), std::string::npos);
  EXPECT_EQ(RowsOf("sep,a\n"), (Rows{{"sep", "a"}}));
}

TEST(Csv, EmptyRowsAreSkippedAndLinesAreCounted) {
  for (const char* eol : {"\n", "\r\n", "\r"}) {
    const std::string e = eol;
    const CsvTable table = TableOf("a;b" + e + ";;;" + e + e + "\"c" + e + "d\";1" + e + "x;2" + e);
    ASSERT_EQ(table.records.size(), 3u);
    EXPECT_EQ(table.records[1].line, 4u);
    EXPECT_EQ(table.records[2].line, 6u);
  }
}

TEST(Csv, CommaIsDecimalOnlyIfItIsNotTheSeparator) {
  const CsvTable semicolons{';', {}}, commas{',', {}};
  EXPECT_EQ(semicolons.Number("65,4"), 65.4);
  EXPECT_EQ(semicolons.Number("-0.5"), -0.5);
  EXPECT_EQ(commas.Number("+1.5e1"), 15.0);
  EXPECT_EQ(commas.Number("\u22120.5"), -0.5);
  for (const char* text : {"65,4", "1,000.5", "", "1 2", "nan", "0x10", "+-1"})
    EXPECT_FALSE(commas.Number(text)) << text;
  for (const char* text : {"1.000,5", "1,000,5", "1,2,3"}) EXPECT_FALSE(semicolons.Number(text)) << text;
}

TEST(Csv, InvalidCsvAndUtf8AreRefusedWithTheirLine) {
  EXPECT_NE(Refusal("a,b\nGr\xFCn,1\n").find("line 2: is not UTF-8"), std::string::npos);
  EXPECT_NE(Refusal(std::string("a\0,\0b\0", 6)).find("UTF-16"), std::string::npos);
  EXPECT_NE(Refusal("a,b\n\"open,1\n2,3\n").find("line 2: a cell in quotation marks is never closed"),
            std::string::npos);
  EXPECT_NE(Refusal("a,b\n\"x\"y,1\n").find("line 2: text follows"), std::string::npos);
  EXPECT_NE(Refusal("5\" tab,1\n").find("line 1: a quotation mark"), std::string::npos);
}

}  // namespace
}  // namespace crownfit

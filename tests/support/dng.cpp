#include "support/dng.h"

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

namespace crownfit {
namespace {

using Bytes = std::string;

void Put(Bytes& out, uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<char>(value >> (8 * i)));
}

enum Type { kByte = 1, kText = 2, kShort = 3, kLong = 4, kRational = 5, kSignedRational = 10 };

struct Entry {
  int tag, type;
  uint32_t count;
  Bytes value;
};

Entry Numbers(int tag, Type type, const std::vector<double>& values) {
  Entry entry{tag, type, static_cast<uint32_t>(values.size()), {}};
  for (double v : values) {
    if (type == kRational || type == kSignedRational) {
      Put(entry.value, static_cast<uint32_t>(std::lround(v * 10000)), 4);
      Put(entry.value, 10000, 4);
    } else {
      Put(entry.value, static_cast<uint64_t>(v), type == kByte ? 1 : type == kShort ? 2 : 4);
    }
  }
  return entry;
}

Entry Text(int tag, const std::string& text) {
  return {tag, kText, static_cast<uint32_t>(text.size() + 1), text + '\0'};
}

}  // namespace

void WriteDng(const std::filesystem::path& file, const Dng& d) {
  const int samples = d.is_mosaic ? 1 : 3;
  // Tags in rising order (TIFF 6.0, DNG 1.4).
  std::vector<Entry> entries{Numbers(254, kLong, {0}),
                             Numbers(256, kLong, {double(d.width)}),
                             Numbers(257, kLong, {double(d.height)}),
                             d.is_mosaic ? Numbers(258, kShort, {16}) : Numbers(258, kShort, {16, 16, 16}),
                             Numbers(259, kShort, {1}),
                             Numbers(262, kShort, {d.is_mosaic ? 32803.0 : 34892.0}),  // filters, or linear
                             Text(271, "Crownfit"),
                             Text(272, "Handmade"),
                             Numbers(273, kLong, {0}),  // where the strip begins, filled in below
                             Numbers(277, kShort, {double(samples)}),
                             Numbers(278, kLong, {double(d.height)}),
                             Numbers(279, kLong, {2.0 * samples * d.width * d.height}),
                             Numbers(284, kShort, {1}),
                             Numbers(33421, kShort, {2, 2}),
                             Numbers(33422, kByte, {0, 1, 1, 2}),
                             Numbers(50706, kByte, {1, 4, 0, 0}),
                             Text(50708, "Crownfit Handmade"),
                             d.is_mosaic ? Numbers(50713, kShort, {2, 2}) : Numbers(50713, kShort, {1, 1}),
                             Numbers(50714, kShort, {d.black.begin(), d.black.begin() + (d.is_mosaic ? 4 : 3)}),
                             Numbers(50717, kShort, {double(d.white)}),
                             Numbers(50721, kSignedRational, {0.7, -0.1, 0, -0.4, 1.2, 0.2, -0.1, 0.2, 0.6}),
                             Numbers(50728, kRational, {d.neutral[0], d.neutral[1], d.neutral[2]}),
                             Numbers(50778, kShort, {21})};
  if (!d.is_mosaic) std::erase_if(entries, [](const Entry& e) { return e.tag == 33421 || e.tag == 33422; });
  const size_t directory = 8, after = directory + 2 + 12 * entries.size() + 4;
  size_t overflow = 0;
  for (const Entry& e : entries) overflow += e.value.size() > 4 ? e.value.size() : 0;
  Bytes strip_begin;
  Put(strip_begin, after + overflow, 4);
  for (Entry& e : entries)
    if (e.tag == 273) e.value = strip_begin;

  Bytes out = "II", beyond;
  Put(out, 42, 2);
  Put(out, directory, 4);
  Put(out, entries.size(), 2);
  for (const Entry& e : entries) {
    Put(out, e.tag, 2);
    Put(out, e.type, 2);
    Put(out, e.count, 4);
    if (e.value.size() > 4) {
      Put(out, after + beyond.size(), 4);
      beyond += e.value;
    } else {
      out += e.value + Bytes(4 - e.value.size(), '\0');
    }
  }
  Put(out, 0, 4);
  out += beyond;
  for (int y = 0; y < d.height; ++y)
    for (int x = 0; x < d.width; ++x)
      for (int k = 0; k < samples; ++k) Put(out, d.counts(x, y), 2);
  std::ofstream(file, std::ios::binary) << out;
}

}  // namespace crownfit

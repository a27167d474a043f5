// libFuzzer's entry, for the parser that $CROWNFIT_FUZZ names: ./dev bench fuzz.

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "fuzz/parsers.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const crownfit::Parser* const parser = [] {
    const char* name = std::getenv("CROWNFIT_FUZZ");
    for (const crownfit::Parser& p : crownfit::Parsers())
      if (name && std::strcmp(p.name, name) == 0) return &p;
    std::fprintf(stderr, "CROWNFIT_FUZZ names no parser\n");
    std::exit(2);
  }();
  crownfit::Feed(*parser, {reinterpret_cast<const char*>(data), size});
  return 0;
}

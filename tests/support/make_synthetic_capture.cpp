// make_synthetic_capture FOLDER PIXELS [SIZE]: the bundled demonstration capture without its photographs (see
// datasets_synthetic/); of a tooth SIZE times as large, which looks the same.

#include <cstdio>
#include <cstdlib>

#include "support/synthetic_capture.h"

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: make_synthetic_capture FOLDER PIXELS [SIZE]\n");
    return 2;
  }
  const double size = argc == 4 ? std::atof(argv[3]) : 1.0;
  crownfit::WriteSyntheticCapture(argv[1], {.pixels = std::atoi(argv[2]), .levels = 72, .size = size});
  return 0;
}

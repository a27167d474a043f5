// make_synthetic_capture FOLDER PIXELS: the bundled demonstration capture without its photographs (see
// datasets_synthetic/).

#include <cstdio>
#include <cstdlib>

#include "support/synthetic_capture.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: make_synthetic_capture FOLDER PIXELS\n");
    return 2;
  }
  crownfit::WriteSyntheticCapture(argv[1], {.pixels = std::atoi(argv[2]), .levels = 72});
  return 0;
}

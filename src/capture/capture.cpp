#include "capture/capture.h"

#include "base/error.h"

namespace crownfit {

std::vector<std::string> ChannelsInFile(const Capture& capture) {
  return capture.channels() == 3 ? std::vector<std::string>{"R", "G", "B"} : capture.channel_names;
}

Quantity ThicknessQuantity(const Capture& capture, size_t layer) {
  const bool next_has_mesh = layer + 1 < capture.layers.size() && capture.layers[layer + 1].surface;
  return next_has_mesh || capture.layers[layer].thickness_field ? Quantity::kThicknessScale : Quantity::kThickness;
}

void RequirePhotographs(const Capture& capture) {
  if (capture.photographs.empty())
    throw InputError(capture.file, "photographs", "the capture has measurements alone, so there is no shape to show",
                     "Use crownfit fit or check with it, and crownfit predict or export with the result.");
}

}  // namespace crownfit

#include "viewer/shown_channels.h"

#include <algorithm>
#include <cmath>

#include "capture/capture.h"
#include "photo/photograph.h"

namespace crownfit {

ShownChannels ShownChannelsOf(const Capture& capture) {
  if (capture.channels() == 3) return {0, 1, 2};
  ShownChannels shown{};
  for (size_t k = 0; k < 3; ++k) {
    const double wanted_nm = std::array{600.0, 540.0, 450.0}[k];
    const auto nearest =
        std::ranges::min_element(capture.wavelengths_nm, {}, [&](double nm) { return std::abs(nm - wanted_nm); });
    shown[k] = static_cast<int>(nearest - capture.wavelengths_nm.begin());
  }
  return shown;
}

Photograph InShownChannels(Photograph photo, const ShownChannels& shown) {
  for (Image* image : {&photo.linear, &photo.variance}) {
    Image three(image->width, image->height, 3);
    for (size_t p = 0; p < three.values.size() / 3; ++p)
      for (size_t k = 0; k < 3; ++k) three.values[3 * p + k] = image->values[image->channels * p + shown[k]];
    *image = std::move(three);
  }
  return photo;
}

Capture ForScreen(Capture capture) {
  if (capture.channels() == 3) return capture;
  for (PhotographSpec& photo : capture.photographs) photo.rgb_from_sensor = {};
  return capture;
}

}  // namespace crownfit

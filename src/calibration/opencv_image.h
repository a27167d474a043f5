#pragma once
// Pictures as OpenCV's detectors want them: 8 bits.

#include <opencv2/core.hpp>

#include "photo/image_io.h"

namespace crownfit {

/// Linear light is scaled so that its 99.5th percentile is white, then encoded as sRGB; encoded files stay as they are.
/// BGR.
cv::Mat Bgr8(const ImageFile& photo);

/// Grey as stored: encoded or linear. For corners between four squares, which no encoding moves.
cv::Mat StoredGrey8(const ImageFile& photo);

/// Grey proportional to the light. Encoding would move every edge towards its dark side: 0.4 px at a blur of 0.6 px.
cv::Mat LinearGrey8(const ImageFile& photo);

}  // namespace crownfit

#include "calibration/opencv_image.h"

#include <algorithm>
#include <cmath>

#include "photo/photograph.h"

namespace crownfit {
namespace {

/// The value that becomes white.
float WhiteOf(const ImageFile& photo) {
  if (photo.transfer.is_encoded()) return 1.0f;
  std::vector<float> values = photo.image.values;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return std::max(*at, 1e-12f);
}

}  // namespace

cv::Mat Bgr8(const ImageFile& photo) {
  const Image& image = photo.image;
  const float white = WhiteOf(photo);
  cv::Mat bgr(image.height, image.width, CV_8UC3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const double value = image.at(x, y, image.channels < 3 ? 0 : c) / white;
        const double encoded = photo.transfer.is_encoded() ? value : SrgbFromLinear(value);
        bgr.at<cv::Vec3b>(y, x)[2 - c] = cv::saturate_cast<uchar>(255.0 * encoded);
      }
  return bgr;
}

namespace {

cv::Mat GreyOf(const ImageFile& photo, bool decode) {
  const Image& image = photo.image;
  const float white = WhiteOf(photo);
  cv::Mat grey(image.height, image.width, CV_8UC1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto value = [&](int c) {
        const double stored = image.at(x, y, c) / white;
        return decode ? photo.transfer.Light(stored, c) : stored;
      };
      const double luminance =
          image.channels < 3 ? value(0) : 0.2126 * value(0) + 0.7152 * value(1) + 0.0722 * value(2);
      grey.at<uchar>(y, x) = cv::saturate_cast<uchar>(255.0 * luminance);
    }
  return grey;
}

}  // namespace

cv::Mat StoredGrey8(const ImageFile& photo) { return GreyOf(photo, false); }
cv::Mat LinearGrey8(const ImageFile& photo) { return GreyOf(photo, photo.transfer.is_encoded()); }

}  // namespace crownfit

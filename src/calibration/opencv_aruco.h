#pragma once

// The one place where OpenCV's marker detection differs between versions (each function stands here once for
// either): 4.7 moved it from the module aruco to objdetect and made its types plain values. Only boards.cpp includes
// this.

#include <opencv2/core.hpp>
#include <opencv2/core/version.hpp>
#include <vector>

#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_detector.hpp>
#define CROWNFIT_ARUCO_IN_OBJDETECT 1
#else
#include <opencv2/aruco.hpp>
#define CROWNFIT_ARUCO_IN_OBJDETECT 0
#endif

namespace crownfit {

/// Corners of every marker, clockwise from its own upper left, where (0, 0) is the centre of the first pixel.
struct FoundMarkers {
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
};

#if CROWNFIT_ARUCO_IN_OBJDETECT

inline cv::aruco::Dictionary PredefinedDictionary(int name) { return cv::aruco::getPredefinedDictionary(name); }

inline FoundMarkers DetectMarkers(const cv::Mat& grey, const cv::aruco::Dictionary& dictionary, int refinement) {
  cv::aruco::DetectorParameters parameters;
  parameters.cornerRefinementMethod = refinement;
  FoundMarkers found;
  cv::aruco::ArucoDetector(dictionary, parameters).detectMarkers(grey, found.corners, found.ids);
  return found;
}

inline cv::Mat DrawMarker(const cv::aruco::Dictionary& dictionary, int id, int side_px) {
  cv::Mat drawn;
  dictionary.generateImageMarker(id, side_px, drawn);
  return drawn;
}

#else

inline cv::aruco::Dictionary PredefinedDictionary(int name) { return *cv::aruco::getPredefinedDictionary(name); }

inline FoundMarkers DetectMarkers(const cv::Mat& grey, const cv::aruco::Dictionary& dictionary, int refinement) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = refinement;
  FoundMarkers found;
  cv::aruco::detectMarkers(grey, cv::makePtr<cv::aruco::Dictionary>(dictionary), found.corners, found.ids, parameters);
  return found;
}

inline cv::Mat DrawMarker(const cv::aruco::Dictionary& dictionary, int id, int side_px) {
  cv::Mat drawn;
  dictionary.drawMarker(id, side_px, drawn);
  return drawn;
}

#endif

}  // namespace crownfit

#pragma once
// The three channels that a screen shows.

#include <array>

namespace crownfit {

struct Capture;
struct Photograph;

/// Indices of the channels that stand for red, green and blue: all of three; else those nearest to 600, 540 and 450 nm.
using ShownChannels = std::array<int, 3>;
ShownChannels ShownChannelsOf(const Capture& capture);

/// A photograph of the shown channels alone.
Photograph InShownChannels(Photograph photo, const ShownChannels& shown);

/// The capture for a screen: where it has other than three channels, the shown ones are taken as linear sRGB.
Capture ForScreen(Capture capture);

}  // namespace crownfit

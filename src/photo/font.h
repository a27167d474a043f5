#pragma once

namespace crownfit {

/// The font of figures and of the viewer: of Debian's package fonts-dejavu-core.
inline constexpr const char* kFontFile = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";

}  // namespace crownfit

#include "photo/spectrum.h"

#include <cstdlib>

#include "base/error.h"
#include "base/text.h"

namespace crownfit {

void Spectrum::FailAt(int channel) {
  Check(false,
        Printed("a spectrum has no channel %d, or another number of channels than its partner", channel).c_str());
  std::abort();
}

}  // namespace crownfit

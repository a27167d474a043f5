#pragma once
// What the program says when it refuses an input.

#include <string>

#include "base/error.h"

namespace crownfit {

/// The message of the InputError that read() throws; empty if it throws none.
std::string FaultOf(const auto& read) {
  try {
    read();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

}  // namespace crownfit

#include "base/background.h"

#include <chrono>
#include <utility>

namespace crownfit {
namespace {

bool IsReady(const std::future<Background::Finish>& work) {
  return work.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

void Background::Start(const std::string& what, std::function<Finish()> work) {
  if (current_.valid()) forgotten_.push_back(std::move(current_));
  std::erase_if(forgotten_, IsReady);
  what_ = what;
  current_ = std::async(std::launch::async, std::move(work));
}

bool Background::Poll() {
  if (!current_.valid() || !IsReady(current_)) return false;
  what_.clear();
  const Finish finish = current_.get();
  finish();
  return true;
}

}  // namespace crownfit

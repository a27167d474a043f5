#pragma once
// One value per channel. The number of channels is known at run time.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <initializer_list>
#include <span>
#include <vector>

namespace crownfit {

inline constexpr int kMostChannels = 16;

// Lanes beyond a spectrum's blocks are never set and never read, which GCC does not see.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

/// One value per channel of a capture, or one value for all channels, however many there are. Operations work channel
/// by channel; with a value for all channels they take the other operand's number of channels. Channels are computed in
/// blocks of four, so that vector instructions compute a block at once; results do not depend on the block.
class Spectrum {
 public:
  /// Zero in all channels.
  Spectrum() : Spectrum(0.0) {}
  /// The same in all channels.
  explicit Spectrum(double value) { v_.fill(value); }
  /// The same in each of `channels` channels, which can be set one by one.
  Spectrum(int channels, double value) : size_(Counted(channels)) {
    ForLanes([&](size_t k) { v_[k] = value; });
  }
  /// each(channel) of every channel.
  template <class Each>
  static Spectrum Of(int channels, const Each& each) {
    Spectrum result(channels, 0.0);
    for (int c = 0; c < channels; ++c) result.v_[static_cast<size_t>(c)] = each(c);
    return result;
  }
  Spectrum(const Spectrum& other) { CopyFrom(other); }
  Spectrum& operator=(const Spectrum& other) {
    CopyFrom(other);
    return *this;
  }
  /// One value per channel. The same value in each of three channels is Spectrum(3, v): Spectrum{3, v} is a list of
  /// two.
  Spectrum(std::initializer_list<double> values) : Spectrum(std::span<const double>(values.begin(), values.size())) {}
  /// Red, green and blue.
  Spectrum(const glm::dvec3& rgb) : Spectrum{rgb.x, rgb.y, rgb.z} {}
  explicit Spectrum(std::span<const double> values) : Spectrum(static_cast<int>(values.size()), 0.0) {
    std::copy(values.begin(), values.end(), v_.begin());
  }

  /// A number of channels, checked.
  static int Counted(int channels) {
    if (channels < 1 || channels > kMostChannels) FailAt(channels);
    return channels;
  }
  /// Number of channels; 0: one value for all.
  int size() const { return size_; }
  double operator[](int channel) const& { return v_[static_cast<size_t>(channel)]; }
  double& operator[](int channel) & {
    if (channel >= size_) FailAt(channel);
    return v_[static_cast<size_t>(channel)];
  }
  const double* begin() const { return v_.data(); }
  const double* end() const { return v_.data() + std::max(1, size_); }
  std::vector<double> list() const { return {begin(), end()}; }

  /// As many entries as channels, where one value stands for all.
  Spectrum Expanded(int channels) const { return size_ == 0 ? Spectrum(channels, v_[0]) : *this; }

  /// Sum over channels of a product.
  double Dot(const Spectrum& b) const { return (*this * b).Sum(); }
  /// Sets all channels.
  void fill(double value) { *this = size_ == 0 ? Spectrum(value) : Spectrum(size_, value); }

  double Sum() const {
    double sum = v_[0];
    for (const double* v = begin() + 1; v < end(); ++v) sum += *v;
    return sum;
  }
  /// The mean over channels.
  double Mean() const { return Sum() / static_cast<double>(end() - begin()); }
  /// Of the channel in the middle of the list: green of red, green, blue.
  double Middle() const { return v_[static_cast<size_t>(size_ / 2)]; }
  double Largest() const { return *std::max_element(begin(), end()); }
  double Smallest() const { return *std::min_element(begin(), end()); }
  bool IsZero() const {
    return std::all_of(begin(), end(), [](double v) { return v == 0; });
  }
  /// Whether all channels have the same value.
  bool IsGrey() const {
    return std::all_of(begin(), end(), [this](double v) { return v == v_[0]; });
  }

  /// each(value of a channel), for all channels.
  template <class Each>
  Spectrum Mapped(const Each& each) const {
    if (size_ == 0) return Spectrum(each(v_[0]));
    Spectrum result(*this);
    for (int c = 0; c < size_; ++c) result.v_[static_cast<size_t>(c)] = each(v_[static_cast<size_t>(c)]);
    return result;
  }

  friend Spectrum operator+(const Spectrum& a, const Spectrum& b) {
    return Combined(a, b, [](double x, double y) { return x + y; });
  }
  friend Spectrum operator-(const Spectrum& a, const Spectrum& b) {
    return Combined(a, b, [](double x, double y) { return x - y; });
  }
  friend Spectrum operator*(const Spectrum& a, const Spectrum& b) {
    return Combined(a, b, [](double x, double y) { return x * y; });
  }
  friend Spectrum operator/(const Spectrum& a, const Spectrum& b) {
    return Combined(a, b, [](double x, double y) { return x / y; });
  }
  friend Spectrum operator+(const Spectrum& a, double b) {
    return Blockwise(a, [b](double x) { return x + b; });
  }
  friend Spectrum operator+(double a, const Spectrum& b) {
    return Blockwise(b, [a](double x) { return a + x; });
  }
  friend Spectrum operator-(const Spectrum& a, double b) {
    return Blockwise(a, [b](double x) { return x - b; });
  }
  friend Spectrum operator-(double a, const Spectrum& b) {
    return Blockwise(b, [a](double x) { return a - x; });
  }
  friend Spectrum operator-(const Spectrum& a) {
    return Blockwise(a, [](double x) { return -x; });
  }
  friend Spectrum operator*(const Spectrum& a, double b) {
    return Blockwise(a, [b](double x) { return x * b; });
  }
  friend Spectrum operator*(double a, const Spectrum& b) {
    return Blockwise(b, [a](double x) { return a * x; });
  }
  friend Spectrum operator/(const Spectrum& a, double b) {
    return Blockwise(a, [b](double x) { return x / b; });
  }
  friend Spectrum operator/(double a, const Spectrum& b) {
    return Blockwise(b, [a](double x) { return a / x; });
  }
  Spectrum& operator+=(const Spectrum& b) {
    return Change(b, [](double& x, double y) { x += y; });
  }
  Spectrum& operator-=(const Spectrum& b) {
    return Change(b, [](double& x, double y) { x -= y; });
  }
  Spectrum& operator*=(const Spectrum& b) {
    return Change(b, [](double& x, double y) { x *= y; });
  }
  Spectrum& operator/=(const Spectrum& b) {
    return Change(b, [](double& x, double y) { x /= y; });
  }
  Spectrum& operator*=(double b) {
    ForLanes([&](size_t k) { v_[k] *= b; });
    return *this;
  }
  Spectrum& operator/=(double b) {
    ForLanes([&](size_t k) { v_[k] /= b; });
    return *this;
  }

  friend Spectrum Exp(const Spectrum& a) {
    return a.Mapped([](double x) { return std::exp(x); });
  }
  friend Spectrum Log(const Spectrum& a) {
    return a.Mapped([](double x) { return std::log(x); });
  }
  friend Spectrum Sqrt(const Spectrum& a) {
    return a.Mapped([](double x) { return std::sqrt(x); });
  }
  friend Spectrum Abs(const Spectrum& a) {
    return Blockwise(a, [](double x) { return std::abs(x); });
  }
  friend Spectrum Max(const Spectrum& a, const Spectrum& b) {
    return Combined(a, b, [](double x, double y) { return x < y ? y : x; });
  }
  friend Spectrum Min(const Spectrum& a, const Spectrum& b) {
    return Combined(a, b, [](double x, double y) { return y < x ? y : x; });
  }
  friend bool operator==(const Spectrum& a, const Spectrum& b) {
    const int channels = std::max({1, a.size_, b.size_});
    return (a.size_ == 0 || b.size_ == 0 || a.size_ == b.size_) &&
           std::equal(a.v_.begin(), a.v_.begin() + channels, b.v_.begin());
  }

 private:
  static constexpr int kBlock = 4;
  static_assert(kMostChannels % kBlock == 0);
  struct Unset {};
  explicit Spectrum(Unset) {}
  [[noreturn]] static void FailAt(int channel);
  /// each(lane) of all lanes in use, block by block.
  template <class Each>
  void ForLanes(const Each& each) const {
    const auto end = static_cast<size_t>(size_ == 0 ? kMostChannels : size_);
    size_t i = 0;
    do {
      for (size_t k = i; k < i + kBlock; ++k) each(k);
      i += kBlock;
    } while (i < end);
  }
  void CopyFrom(const Spectrum& other) {
    size_ = other.size_;
    ForLanes([&](size_t k) { v_[k] = other.v_[k]; });
  }
  template <class Each>
  static Spectrum Blockwise(const Spectrum& a, const Each& each) {
    Spectrum result{Unset()};
    result.size_ = a.size_;
    result.ForLanes([&](size_t k) { result.v_[k] = each(a.v_[k]); });
    return result;
  }
  template <class Each>
  static Spectrum Combined(const Spectrum& a, const Spectrum& b, const Each& each) {
    Spectrum result{Unset()};
    if (a.size_ != b.size_ && a.size_ != 0 && b.size_ != 0) FailAt(b.size_);
    result.size_ = std::max(a.size_, b.size_);
    result.ForLanes([&](size_t k) { result.v_[k] = each(a.v_[k], b.v_[k]); });
    return result;
  }
  template <class Each>
  Spectrum& Change(const Spectrum& b, const Each& each) {
    if (size_ != b.size_ && b.size_ != 0) {
      if (size_ != 0) FailAt(b.size_);
      size_ = b.size_;
    }
    ForLanes([&](size_t k) { each(v_[k], b.v_[k]); });
    return *this;
  }
  int size_ = 0;
  std::array<double, kMostChannels> v_;  ///< all are set where size_ is 0, else those of the channels' blocks
};

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

/// Spectra side by side, without room for channels that a capture lacks.
template <class Real = float>
class SpectrumArray {
 public:
  SpectrumArray() = default;
  SpectrumArray(size_t count, int channels) { resize(count, channels); }
  void resize(size_t count, int channels) {
    channels_ = static_cast<size_t>(channels);
    values_.resize(count * channels_);
  }
  size_t size() const { return channels_ == 0 ? 0 : values_.size() / channels_; }
  bool empty() const { return values_.empty(); }
  int channels() const { return static_cast<int>(channels_); }
  Real at(size_t i, int channel) const { return values_[i * channels_ + static_cast<size_t>(channel)]; }
  Real& at(size_t i, int channel) { return values_[i * channels_ + static_cast<size_t>(channel)]; }
  Spectrum operator[](size_t i) const {
    Spectrum result(static_cast<int>(channels_), 0.0);
    for (int c = 0; c < channels(); ++c) result[c] = at(i, c);
    return result;
  }
  void Set(size_t i, const Spectrum& value) {
    for (int c = 0; c < channels(); ++c) at(i, c) = static_cast<Real>(value[c]);
  }
  /// The first one states the number of channels, so it can't be one value for all.
  void push_back(const Spectrum& value) {
    if (channels_ == 0) channels_ = static_cast<size_t>(Spectrum::Counted(value.size()));
    for (int c = 0; c < channels(); ++c) values_.push_back(static_cast<Real>(value[c]));
  }
  /// Adds to one element, channel by channel.
  void Add(size_t i, double factor, const SpectrumArray& other, size_t j) {
    for (int c = 0; c < channels(); ++c) at(i, c) += static_cast<Real>(factor) * other.at(j, c);
  }
  void Scale(double factor) {
    for (Real& v : values_) v *= static_cast<Real>(factor);
  }
  friend bool operator==(const SpectrumArray&, const SpectrumArray&) = default;
  void clear() { values_.clear(); }
  void Append(const SpectrumArray& more) {
    if (channels_ == 0) channels_ = more.channels_;
    values_.insert(values_.end(), more.values_.begin(), more.values_.end());
  }

 private:
  size_t channels_ = 0;
  std::vector<Real> values_;
};

}  // namespace crownfit
